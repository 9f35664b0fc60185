"""A robot that is driven along a course, in the plane and in MuJoCo, by a regulator that was made to stand."""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest
from hydra import compose
from hydra.utils import instantiate

from twbal.algorithm.following import FollowedCourse, FollowedSegment, floor_needed, followed
from twbal.algorithm.rollout import rollout
from twbal.algorithm.tables import course_table
from twbal.cli.composition import composing
from twbal.core.channels import Channels
from twbal.core.course import Course, Standing
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.core.evaluation import PlaceBy
from twbal.core.feed_forward import FeedForward
from twbal.core.plant import Observation, Plant, Pose
from twbal.core.robot_parameters import RobotParameters
from twbal.core.start_pose import StartPose
from twbal.models.dataset import transitions
from twbal.planar.linearised import sampled_with_delay
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_plant import PlanarPlant
from twbal.policies.policy import Policy
from twbal.search.linear_starts import linear_law, regulator, state_space
from twbal.virtual_robot.drawn import draw_ground_truth
from twbal.virtual_robot.mujoco_robot import MujocoRobot

FORTH = ({"seconds": 1.0, "speed": 0.0}, {"seconds": 8.0, "speed": 0.5}, {"seconds": 5.0, "speed": 0.0})


class Parts(NamedTuple):
    robot: RobotParameters
    channels: Channels
    policy: Policy
    faults: Any


@cache
def parts() -> Parts:
    """The paper's robot, and the regulator from which the default's search for it begins: made to stand in a place."""
    with composing():
        cfg, faults = compose("lqr"), compose("virtual_robot", ["faults=light"]).faults
        robot, channels, cost = (instantiate(cfg[part]) for part in ("robot", "state", "cost"))
    linear = sampled_with_delay(planar_parameters(robot, {}), robot.control_period, len(channels.lags))
    gain = regulator(*state_space(linear, channels), cost, robot.torque_limit)
    assert gain is not None
    policy = linear_law(channels.names, gain, robot.torque_limit, compensation=0.0)
    return Parts(robot, channels, policy, instantiate(faults))


class Pushed(PlanarPlant):
    """The robot in the plane, with a force on its axle [N] that follows from time, place and speed."""

    def __init__(self, force: Callable[[float, float, float], float] = lambda *_: 0.0) -> None:
        start = StartPose(0.0, 0.0, 0.0, 0.0)
        super().__init__(robot=parts().robot, effects=[], start=start, physics_step=0.001, seed=0)
        self._force = force

    def step(self, command: float) -> Observation:
        time, state = len(self._commands) * self.control_period, self._state
        force = self._force(time, state.position, self._constants.radius * state.wheel_speed)
        self._constants = self._constants._replace(pushed=force)
        return super().step(command)


def drive(plant: Plant, segments: Sequence[dict[str, float]], give_way: float = 0.3) -> tuple[Episode, Course]:
    robot, channels, policy, _ = parts()
    course = Course.from_settings(robot, segments, give_way=give_way)
    steps, source = course.steps(robot.control_period), Provenance("paper", "simulation")
    return rollout(plant, policy, channels, steps, 0.5236, source, course), course


def texts(episode: Episode) -> list[str]:
    return [event.text for event in episode.events]


@pytest.mark.parametrize("speed", [0.3, 0.5, 1.0, -1.0])
def test_a_policy_that_holds_a_place_follows_ramps_in_the_plane(speed: float) -> None:
    episode, course = drive(Pushed(), ({"seconds": 10.0, "speed": speed}, {"seconds": 6.0, "speed": 0.0}))
    found = followed(episode, course, parts().robot.wheel_radius)
    assert (found.outcome, found.fell, found.gave_way) == (Outcome.COMPLETED, False, 0)
    assert abs(found.segments[0].speed_error or 99.0) < 5.0
    assert abs(found.segments[1].off_at_end) < 0.05


def test_a_step_of_the_speed_asks_for_far_more_than_the_ramp_does() -> None:
    robot, channels, policy, _ = parts()
    settings = {"acceleration_limit": 1e3, "jerk_limit": 1e5, "give_way": 100.0}
    course = Course.from_settings(robot, ({"seconds": 5.0, "speed": 1.0},), **settings)
    thrown = rollout(Pushed(), policy, channels, 250, 0.5236, Provenance("paper", "simulation"), course)
    ramped, _ = drive(Pushed(), ({"seconds": 5.0, "speed": 1.0},))
    assert np.abs(thrown.tilt).max() > 3.0 * np.abs(ramped.tilt).max()


def test_the_reference_waits_at_a_wall_and_goes_on_when_it_is_gone() -> None:
    def wall(time: float, place: float, speed: float) -> float:
        return -300.0 * (place - 1.2) - 30.0 * speed if place > 1.2 and time < 10.0 else 0.0

    episode, course = drive(Pushed(wall), ({"seconds": 20.0, "speed": 0.3}, {"seconds": 5.0, "speed": 0.0}))
    assert episode.references is not None and episode.poses is not None
    assert texts(episode)[:2] == ["the reference gives way", "the reference goes on"]
    assert episode.outcome is Outcome.COMPLETED and np.abs(episode.tilt).max() < 0.45
    away = np.abs(episode.poses[:, 0] - episode.references[:, 0])
    assert away.max() < course.give_way + 1e-6
    late = episode.observations[:, 0] > 15.0
    assert episode.poses[-1, 0] > 3.0 and away[late].max() < 0.15


def test_a_push_while_driving_is_survived_and_the_robot_goes_on() -> None:
    def push(time: float, place: float, speed: float) -> float:
        return -50.0 if 5.0 <= time < 5.2 else 0.0  # 10 N·s on 12 kg

    episode, course = drive(Pushed(push), FORTH, give_way=0.15)
    found = followed(episode, course, parts().robot.wheel_radius)
    assert found.outcome is Outcome.COMPLETED and found.gave_way >= 1
    assert abs(found.segments[2].off_at_end) < 0.1


def stands(plant: Plant, yields: bool, until: float = 12.0) -> Episode:
    """A rollout in which the robot is to stand [s]."""
    robot, channels, policy, _ = parts()
    targets, source = Standing.of_robot(robot) if yields else None, Provenance("paper", "simulation")
    steps, ahead = round(until / robot.control_period), FeedForward.of_robot(robot)
    return rollout(plant, policy, channels, steps, 0.5236, source, targets, feed_forward=ahead)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_robot_that_yields_to_a_push_stands_one_that_throws_over_a_robot_that_resists(sign: float) -> None:
    def push(time: float, place: float, speed: float) -> float:
        return sign * 230.0 if 2.0 <= time < 2.1 else 0.0  # 23 N·s on 12 kg

    resists, yields = (stands(Pushed(push), yields) for yields in (False, True))
    assert resists.outcome is Outcome.TILT_LIMIT
    assert yields.outcome is Outcome.COMPLETED and np.abs(yields.tilt).max() < 0.47
    assert set(texts(yields)) == {"the reference takes on speed from the robot, which is pushed"}
    assert yields.references is not None and yields.poses is not None
    assert (sign * yields.poses[:, 0]).max() > 0.2
    assert np.abs(yields.poses[-100:, 0]).max() < 0.05  # back in its place


def test_a_robot_that_yields_and_is_not_pushed_is_driven_as_one_that_does_not() -> None:
    resists, yields = (stands(Pushed(), yields, until=4.0) for yields in (False, True))
    assert yields.references is None
    assert yields.states.tobytes() == resists.states.tobytes()
    assert yields.commands.tobytes() == resists.commands.tobytes()


def test_a_robot_in_mujoco_with_light_faults_reaches_a_metre_a_second_and_comes_back() -> None:
    robot = parts().robot
    truth = draw_ground_truth(parts().faults, robot, 1)
    start = StartPose(-0.05, 0.0, 0.0, 0.0)
    plant = MujocoRobot(truth=truth, control_period=0.02, start=start, physics_step=0.0005, seed=1)
    segments = [{"seconds": 3.0, "speed": 0.0}, {"seconds": 10.0, "speed": 1.0}, {"seconds": 5.0, "speed": 0.0}]
    episode, course = drive(plant, [*segments, {"seconds": 10.0, "speed": -1.0}, {"seconds": 3.0, "speed": 0.0}])
    found = followed(episode, course, robot.wheel_radius)
    assert not found.fell and found.place_by is PlaceBy.POSE
    assert [abs(found.segments[i].speed_error or 99.0) < 5.0 for i in (1, 3)] == [True, True]


# How well it followed


def made_up(places: np.ndarray, references: np.ndarray, heading: float = 0.0) -> Episode:
    """An episode of a robot that was at these places along a straight line that leaves at an angle."""
    count = len(places)
    observations = np.zeros((count, 7))
    observations[:, 0] = 0.02 * np.arange(count)
    poses = np.zeros((count, len(Pose._fields)))
    poses[:, 0], poses[:, 1], poses[:, 2] = places * np.cos(heading), places * np.sin(heading), heading
    source = Provenance("made up", "robot", trial=7)
    states, commands = np.zeros((count, 2)), np.zeros(count - 1)
    rows = np.column_stack([references, np.gradient(references, 0.02), np.zeros(count)])
    names = ("tilt", "speed")
    return Episode(names, 0.02, observations, states, commands, Outcome.COMPLETED, source, poses=poses, references=rows)


@pytest.mark.parametrize("heading", [0.0, 0.5])
def test_the_speed_error_is_that_of_the_late_part_along_the_robots_own_way(heading: float) -> None:
    time = 0.02 * np.arange(501)
    places = np.where(time < 5.0, 0.3 * time, 1.5 + 0.45 * (time - 5.0))  # slow at first
    course = Course.from_settings(parts().robot, ({"seconds": 10.0, "speed": 0.5},))
    (segment,) = followed(made_up(places, 0.5 * time, heading), course, 0.15).segments
    assert segment.speed == pytest.approx(0.45) and segment.speed_error == pytest.approx(-10.0)
    assert segment.farthest == pytest.approx(1.25) and segment.off_at_end == pytest.approx(-1.25)


def test_segments_that_were_not_reached_are_not_told_of_and_the_table_has_a_line_for_each_other() -> None:
    course = Course.from_settings(parts().robot, ({"seconds": 1.0, "speed": 0.0}, {"position": 1.0}, *FORTH))
    found = followed(made_up(np.zeros(76), np.zeros(76)), course, 0.15)
    assert [segment.asked_position for segment in found.segments] == [None, 1.0]
    assert found.segments[0].speed == pytest.approx(0.0) and found.segments[0].speed_error is None
    _, *lines = course_table([found])
    assert len(lines) == 2 and "to 1.00 m" in lines[1] and lines[0].split()[0] == "7"


def test_the_table_says_which_heading_was_asked_for_where_it_is_controlled() -> None:
    turned = FollowedSegment(0.0, 2.0, 0.0, None, 0.0, None, 0.1, 0.0, asked_heading=np.pi / 2, heading_off_at_end=0.1)
    uncontrolled = FollowedSegment(2.0, 3.0, 0.0, None, 0.0, None, 0.1, 0.0)
    course = FollowedCourse(0, Outcome.COMPLETED, False, 3.0, PlaceBy.POSE, None, 0, (turned, uncontrolled))
    header, first, second = course_table([course])
    assert header.endswith("asked heading  heading off at the end")
    assert first.split()[-2:] == ["90°", "+5.7°"] and second.split()[-2:] == ["-", "-"]


def test_a_segment_between_two_samples_is_left_out() -> None:
    course = Course.from_settings(
        parts().robot, ({"seconds": 0.11, "speed": 0.1}, {"seconds": 0.005, "speed": 0.2}, {"seconds": 0.2, "speed": 0})
    )
    found = followed(made_up(np.zeros(16), np.zeros(16)), course, 0.15)
    assert [segment.asked_speed for segment in found.segments] == [0.1, 0.0]


def test_the_floor_that_a_course_needs_is_the_way_of_its_trapezoids() -> None:
    course = Course.from_settings(
        parts().robot,
        ({"seconds": 6.0, "speed": 0.5}, {"seconds": 4.0, "speed": 0.0}, {"position": -0.25}),
        acceleration_limit=0.5,
        jerk_limit=1e4,
    )
    need = floor_needed(course)
    assert need.ahead == pytest.approx(0.5 * 6.0, abs=0.05)  # what is missing at the start is driven in stopping
    assert need.behind == pytest.approx(0.25, abs=0.01)


def test_models_learn_from_the_speed_over_ground() -> None:
    channels = parts().channels
    driven, _ = drive(Pushed(), FORTH)
    speed, steps = channels.index("speed"), len(driven)
    over_ground = channels.measured_values(Observation(*driven.observations.T))["speed"]
    np.testing.assert_allclose(transitions([driven], channels).inputs[:, speed], over_ground[:steps], atol=1e-12)
    assert np.abs(driven.states[:, speed] - over_ground).max() == pytest.approx(0.5)
