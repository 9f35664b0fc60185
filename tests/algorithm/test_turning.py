"""Robots in MuJoCo that turn, judged by their true poses, under regulators that were made to stand in a place."""

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from hydra import compose
from hydra.utils import instantiate

from twbal.algorithm.following import FollowedCourse, floor_needed, followed
from twbal.algorithm.rollout import rollout
from twbal.cli.composition import composing
from twbal.core.channels import Channels
from twbal.core.course import Course
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.core.heading_control import HeadingControl
from twbal.core.robot_parameters import RobotParameters
from twbal.core.start_pose import StartPose
from twbal.planar.linearised import sampled_with_delay
from twbal.planar.parameters import planar_parameters
from twbal.policies.policy import Policy
from twbal.search.linear_starts import linear_law, regulator, state_space
from twbal.virtual_robot.drawn import draw_ground_truth
from twbal.virtual_robot.mujoco_robot import MujocoRobot

STAND = {"seconds": 3.0, "speed": 0.0}


class Parts(NamedTuple):
    robot: RobotParameters
    channels: Channels
    policy: Policy


@cache
def parts(sheet: str) -> Parts:
    """A sheet's robot, and the regulator from which the default's search for it begins."""
    with composing():
        cfg = compose("lqr", [f"robot={sheet}"])
        robot, channels, cost = (instantiate(cfg[part]) for part in ("robot", "state", "cost"))
    linear = sampled_with_delay(planar_parameters(robot, {}), robot.control_period, len(channels.lags))
    gain = regulator(*state_space(linear, channels), cost, robot.torque_limit)
    assert gain is not None
    return Parts(robot, channels, linear_law(channels.names, gain, robot.torque_limit, compensation=0.0))


@cache
def driven(
    segments: Sequence[tuple[tuple[str, float], ...]], faults: str = "light", sheet: str = "paper", seed: int = 1
) -> tuple[Episode, FollowedCourse]:
    robot, channels, policy = parts(sheet)
    with composing():
        truth = draw_ground_truth(instantiate(compose("virtual_robot", [f"faults={faults}"]).faults), robot, seed)
    start, step = StartPose(-0.05, 0.0, 0.0, 0.0), 0.0005
    plant = MujocoRobot(truth=truth, control_period=robot.control_period, start=start, physics_step=step, seed=seed)
    course = Course.from_settings(robot, [dict(segment) for segment in segments])
    assert course.heading is not None
    heading = HeadingControl(robot, course.heading, plant.has_yaw_gyro)
    steps, source = course.steps(robot.control_period), Provenance(sheet, "simulation")
    episode = rollout(plant, policy, channels, steps, 0.5236, source, course, heading)
    return episode, followed(episode, course, robot.wheel_radius)


def drive(*segments: dict[str, float], **choices: object) -> tuple[Episode, FollowedCourse]:
    return driven(tuple(tuple(segment.items()) for segment in segments), **choices)  # type: ignore[arg-type]


def heading_at_the_end(episode: Episode) -> float:
    assert episode.poses is not None
    return float(np.degrees(np.unwrap(episode.poses[:, 2])[-1]))


TURNS = STAND, {"turn": 90.0}, STAND, {"turn": -180.0}, STAND
SQUARE = STAND, *(part for side in range(1, 5) for part in ({"radii": 7.0 * side}, STAND, {"turn": 90.0}, STAND))


@pytest.mark.parametrize("faults", ["none", "light"])
def test_turns_of_90_and_180_degrees_end_within_3_degrees(faults: str) -> None:
    episode, found = drive(*TURNS, faults=faults)
    assert episode.outcome is Outcome.COMPLETED
    assert heading_at_the_end(episode) == pytest.approx(-90.0, abs=3.0)
    off = [np.degrees(segment.heading_off_at_end or 0.0) for segment in found.segments]
    assert np.abs([off[2], off[4]]).max() < 3.0  # at the ends of the times of standing after each turn
    assert found.heading_error is not None and np.degrees(found.heading_error) < 10.0


@pytest.mark.parametrize("faults", ["none", "light"])
def test_a_square_with_sides_of_seven_radii_is_closed(faults: str) -> None:
    episode, found = drive(*SQUARE, faults=faults)
    assert episode.outcome is Outcome.COMPLETED and episode.poses is not None
    assert heading_at_the_end(episode) == pytest.approx(360.0, abs=3.0)
    assert found.from_start is not None and found.from_start < 0.15
    x, y = episode.poses[:, 0], episode.poses[:, 1]
    assert x.max() == pytest.approx(1.05, abs=0.4) and y.max() == pytest.approx(1.05, abs=0.4)  # it was a square


def test_without_control_of_the_heading_the_same_robot_drives_a_bend() -> None:
    """What control is worth: the same robot, course and policy, with and without."""
    segments = STAND, {"seconds": 10.0, "speed": 0.5}
    kept, _ = drive(*segments, faults="light", seed=2)
    robot, channels, policy = parts("paper")
    with composing():
        truth = draw_ground_truth(instantiate(compose("virtual_robot", ["faults=light"]).faults), robot, 2)
    plant = MujocoRobot(
        truth=truth, control_period=0.02, start=StartPose(-0.05, 0.0, 0.0, 0.0), physics_step=0.0005, seed=2
    )
    course = Course.from_settings(robot, segments)
    free = rollout(plant, policy, channels, course.steps(0.02), 0.5236, Provenance("paper", "simulation"), course)
    assert free.headings is None
    assert abs(heading_at_the_end(kept)) < 2.0 < 0.5 * abs(heading_at_the_end(free))


def test_an_episode_keeps_what_the_control_knew_and_did() -> None:
    episode, _ = drive(*TURNS, faults="light")
    assert episode.headings is not None and episode.poses is not None
    reference, _, estimate, _, difference = episode.headings.T
    assert reference[-1] == pytest.approx(np.radians(-90.0), abs=1e-6)
    assert np.degrees(np.abs(estimate - np.unwrap(episode.poses[:, 2]))).max() < 3.0
    assert 0.1 < np.abs(difference).max() <= 0.25 * 20.0


@pytest.mark.parametrize("sheet", ["regbot", "tumbller", "balboa", "lego", "upkie", "esp32"])
def test_robots_of_other_sheets_turn_by_numbers_of_their_sheets(sheet: str) -> None:
    episode, _ = drive(*TURNS, faults="none", sheet=sheet)
    assert episode.outcome is Outcome.COMPLETED
    assert heading_at_the_end(episode) == pytest.approx(-90.0, abs=3.0)


def test_the_floor_that_a_square_needs_has_sides() -> None:
    course = Course.from_settings(parts("paper").robot, [dict(segment) for segment in SQUARE])
    need = floor_needed(course)
    assert (need.ahead, need.left) == pytest.approx((1.05, 1.05), abs=0.02)
    assert (need.behind, need.right) == pytest.approx((0.0, 0.0), abs=0.02)
