"""Heading: estimated from gyro and wheels, and kept at that of a reference."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from twbal.core.course import Course, HeadingCourse, Target
from twbal.core.errors import ConfigError
from twbal.core.heading import HeadingEstimate
from twbal.core.heading_control import FRICTION_SHARE, HeadingControl
from twbal.core.mobility import falling_time, yaw_inertia, yaw_mobility
from twbal.core.motion_limits import TURNING_SHARE, MotionLimits
from twbal.core.motion_profile import Motion, profile_to_position, profile_to_speed
from twbal.core.plant import Observation, WheelDifference
from twbal.core.robot_parameters import RobotParameters

PERIOD = 0.02


def paper(**other: float) -> RobotParameters:
    values = {"body_mass": 10.0, "com_height": 0.3, "com_offset": 0.0, "body_inertia_pitch": 0.319}
    values |= {"body_inertia_roll": 0.433, "body_inertia_yaw": 0.152, "wheel_mass": 1.0, "wheel_radius": 0.15}
    values |= {"wheel_inertia": 0.0125, "wheel_width": 0.04, "track": 0.45, "torque_limit": 20.0}
    return RobotParameters(name="paper", **values | {"control_period": PERIOD} | other)


# The estimate


def turned(time: float) -> float:
    """Of a robot that stands for 20 s, turns by 2 rad to the left, and stands."""
    return 1.0 - math.cos(math.pi * min(max(time - 20.0, 0.0), 4.0) / 4.0)


def estimated(
    bias: float = 0.0, noise: float = 0.0, wheels: float | None = 1.0, has_gyro: bool = True, until: float = 40.0
) -> HeadingEstimate:
    """After that turn; `wheels` is the radius that they have, over that of the sheet."""
    robot, rng = paper(), np.random.default_rng(0)
    estimate = HeadingEstimate(robot, has_gyro)
    for time in np.arange(0.0, until, PERIOD).tolist():
        rate = (turned(time + 1e-4) - turned(time - 1e-4)) / 2e-4
        scale = robot.track / robot.wheel_radius / (wheels or 1.0)
        apart = WheelDifference(scale * turned(time), scale * rate) if wheels is not None else None
        stands = not 20.0 <= time <= 24.0
        estimate.follow(time, rate + bias + noise * float(rng.standard_normal()), apart, stands)
    return estimate


def test_gyro_and_wheels_that_agree_tell_the_heading() -> None:
    assert estimated().heading == pytest.approx(2.0, abs=1e-3)


def test_the_gyros_bias_is_learned_while_the_robot_stands() -> None:
    found = estimated(bias=0.03, noise=0.02)
    assert found.bias == pytest.approx(0.03, abs=0.003)
    assert found.heading == pytest.approx(2.0, abs=0.03)  # by integration alone it would be 3.2


def test_a_bias_is_not_taken_from_a_turn_whose_wheels_are_of_another_radius() -> None:
    assert estimated(wheels=1.2).heading == pytest.approx(2.0, abs=1e-3)


def stood(heading: Callable[[float], float], by_wheels: Callable[[float], float], walk: float = 0.0) -> HeadingEstimate:
    """After a minute in which the robot is to stand, behind a gyro whose bias walks by `walk` [rad/s/√s]."""
    robot, rng, bias = paper(), np.random.default_rng(1), 0.0
    estimate, scale = HeadingEstimate(robot, has_gyro=True), robot.track / robot.wheel_radius
    for time in np.arange(0.0, 60.0, PERIOD).tolist():
        bias += walk * math.sqrt(PERIOD) * float(rng.standard_normal())
        rate = (heading(time + 1e-4) - heading(time - 1e-4)) / 2e-4
        estimate.follow(time, rate + bias, WheelDifference(scale * by_wheels(time), 0.0), stands=True)
    return estimate


def test_while_the_robot_stands_its_wheels_hold_the_heading_against_the_gyros_drift() -> None:
    """By integration it would drift by 0.07 rad."""

    def rocking(time: float) -> float:
        return 0.02 * math.sin(2.0 * time)

    assert stood(rocking, rocking, walk=0.002).heading == pytest.approx(rocking(60.0), abs=0.01)


def test_a_robot_that_is_lifted_and_turned_while_its_wheels_stand_has_turned() -> None:
    found = stood(lambda time: 0.8 * min(max(time - 20.0, 0.0), 1.0), lambda time: 0.0)
    assert found.heading == pytest.approx(0.8, abs=0.15)


def test_without_a_gyro_the_wheels_tell_the_heading() -> None:
    assert estimated(bias=9.0, has_gyro=False).heading == pytest.approx(2.0, abs=1e-6)
    assert estimated(has_gyro=False, until=22.0).rate == pytest.approx(math.pi / 4.0, rel=0.01)


def test_without_wheels_that_are_told_apart_the_gyro_is_taken_as_it_is() -> None:
    assert estimated(wheels=None).heading == pytest.approx(2.0, abs=1e-3)
    assert estimated(bias=0.01, wheels=None).heading == pytest.approx(2.0 + 0.4, abs=0.01)


# The loop


class Spinning:
    """ψ̈ = b d / (2 r J) less dry friction, by small steps; a difference acts some periods late."""

    def __init__(self, robot: RobotParameters, friction: float = 0.0, inertia: float = 1.0, late: int = 1) -> None:
        self.heading = self.rate = 0.0
        self._waiting = [0.0] * late
        self._mobility, self.friction, self.is_held = yaw_mobility(robot) / inertia, friction, False

    def step(self, difference: float) -> None:
        self._waiting.append(difference)
        acting = self._waiting.pop(0)
        for _ in range(20):
            push = acting - self.friction * math.tanh(self.rate / 0.01)
            self.rate += PERIOD / 20 * self._mobility * push * (not self.is_held)
            self.heading += PERIOD / 20 * self.rate

    def seen(self, time: float) -> tuple[Observation, WheelDifference]:
        return Observation(time, 0.0, 0.0, 0.0, 0.0, 0.0, self.rate), WheelDifference(
            3.0 * self.heading, 3.0 * self.rate
        )


def spun(
    robot: RobotParameters,
    degrees: float,
    friction: float = 0.0,
    command: float = 0.0,
    held: float = 0.0,
    true_inertia: float = 1.0,
    late: int = 1,
    limit: float = math.inf,
) -> tuple[np.ndarray, list[str]]:
    """True headings less those of the reference, the samples and the events of a turn after 1 s; held until `held`."""
    course = Course.from_settings(robot, [{"seconds": 1.0, "speed": 0.0}, {"turn": degrees}]).heading
    assert course is not None
    control, plant = HeadingControl(robot, course, has_gyro=True), Spinning(robot, friction, true_inertia, late)
    rows = []
    for time in np.arange(0.0, 12.0, PERIOD).tolist():
        plant.is_held = time < held
        control.follow(*plant.seen(time), Motion())
        rows.append((time, plant.heading, *control.samples[-1]._replace(difference=control.difference(command, limit))))
        plant.step(control.samples[-1].difference)
    return np.array(rows), [event.text for event in control.reference.events]


@pytest.mark.parametrize("degrees", [90.0, -180.0, 360.0])
@pytest.mark.parametrize("inertia", [0.7, 1.0, 1.4])
def test_a_turn_ends_where_it_was_told_to_also_where_the_inertia_is_not_that_of_the_sheet(
    degrees: float, inertia: float
) -> None:
    rows, events = spun(paper(), degrees, true_inertia=inertia)
    assert np.degrees(rows[-1, 1]) == pytest.approx(degrees, abs=0.5)
    assert not events
    late = np.degrees(np.abs(rows[:, 1] - rows[:, 2]))
    assert late.max() < 10.0


def test_dry_friction_costs_no_lasting_error() -> None:
    rows, _ = spun(paper(), 90.0, friction=1.5)
    assert np.degrees(rows[-1, 1]) == pytest.approx(90.0, abs=1.0)


@pytest.mark.parametrize("degrees", [90.0, -180.0])
def test_what_was_integrated_against_friction_does_not_drive_the_robot_on_when_the_turn_is_over(degrees: float) -> None:
    rows, _ = spun(paper(), degrees, friction=1.5)
    beyond = np.degrees(math.copysign(1.0, degrees) * rows[:, 1]).max() - abs(degrees)
    assert beyond < 0.2


def test_a_robot_that_is_light_and_reacts_late_is_not_shaken() -> None:
    """Beyond the delay at which the loop of the sheet's gains is stable: it shakes a few times, and then no more."""
    rows, _ = spun(paper(), 90.0, true_inertia=0.7, late=3)
    late = rows[rows[:, 0] > 8.0]
    assert np.abs(late[:, -1]).max() < 0.1
    assert np.degrees(late[-1, 1]) == pytest.approx(90.0, abs=3.0)


@pytest.mark.parametrize("degrees", [90.0, -180.0])
def test_friction_that_takes_more_than_the_share_that_moves_the_robot_is_overcome(degrees: float) -> None:
    rows, _ = spun(paper(), degrees, friction=1.5 * TURNING_SHARE * 20.0)
    assert np.degrees(rows[-1, 1]) == pytest.approx(degrees, abs=2.0)


def test_a_robot_that_rolls_now_and_then_and_sticks_in_between_does_not_hunt() -> None:
    """Pushed off its heading it sticks there; for a tenth of each second its wheels roll, and no friction holds it."""
    course = Course.from_settings(paper(), [{"seconds": 1.0, "speed": 0.0}]).heading
    assert course is not None
    control, plant = HeadingControl(paper(), course, has_gyro=True), Spinning(paper(), late=3)
    headings = []
    for time in np.arange(0.0, 20.0, PERIOD).tolist():
        plant.rate += 1.5 if time == 4.0 else 0.0
        plant.friction = 4.0 if time % 1.0 < 0.9 else 0.0
        control.follow(*plant.seen(time), Motion())
        plant.step(control.difference(0.0))
        headings.append(abs(math.degrees(plant.heading)))
    assert max(headings[200:300]) > 2.0
    assert max(headings[400:]) < 1.0


def test_the_difference_keeps_within_its_share_and_within_what_balancing_leaves() -> None:
    robot = paper()
    for command, most in ((0.0, (TURNING_SHARE + FRICTION_SHARE) * 20.0), (-18.0, 2.0), (25.0, 0.0)):
        rows, _ = spun(robot, 180.0, held=12.0, command=command)
        assert np.abs(rows[:, -1]).max() == pytest.approx(most, abs=1e-9)


def test_a_limit_of_the_robot_bounds_the_difference_and_what_is_integrated_behind_it() -> None:
    rows, _ = spun(paper(), 180.0, held=12.0, limit=1.5)
    assert np.abs(rows[:, -1]).max() == pytest.approx(1.5, abs=1e-12)


def test_behind_the_robots_own_limit_nothing_winds_up() -> None:
    """A hand turns a robot that is to stand, and lets it go: what cannot act is not integrated."""
    course = Course.from_settings(paper(), [{"seconds": 1.0, "speed": 0.0}]).heading
    assert course is not None
    control = HeadingControl(paper(), course, has_gyro=True)
    for step in range(1000):
        held = 0.02 if step > 50 else 0.0  # [rad]: asks for less than its share, and more than the limit
        seen = Observation(step * PERIOD, 0.0, 0.0, 0.0, 0.0, 0.0, 0.02 / PERIOD if step == 51 else 0.0)
        control.follow(seen, WheelDifference(3.0 * held, 0.0), Motion())
        assert abs(control.difference(0.0, 0.1)) <= 0.1
    assert abs(control._integrals.straight) < 0.01


def test_a_robot_that_is_held_meets_no_growing_error_and_does_not_spin_when_it_is_let_go() -> None:
    rows, events = spun(paper(), 180.0, held=6.0)
    assert events == ["the heading's reference gives way", "the heading's reference goes on"]
    assert np.abs(rows[:, 2] - rows[:, 1]).max() <= 0.3 * 1.17 + 0.02
    assert np.degrees(rows[:, 1]).max() < 190.0
    assert np.degrees(rows[-1, 1]) == pytest.approx(180.0, abs=1.0)


# Limits and courses


def test_the_yaw_inertia_is_that_of_body_and_rolling_wheels_by_their_kinetic_energy() -> None:
    robot, rate = paper(), 1.3
    wheel_speed = 0.5 * robot.track * rate
    across = robot.wheel_mass * (3.0 * 0.15**2 + 0.04**2) / 12.0
    energy = 0.5 * robot.body_inertia_yaw * rate**2 + 2 * 0.5 * across * rate**2
    energy += 2 * 0.5 * (robot.wheel_mass * wheel_speed**2 + robot.wheel_inertia * (wheel_speed / 0.15) ** 2)
    assert yaw_inertia(robot) == pytest.approx(2.0 * energy / rate**2)


def test_a_bend_at_the_speed_limit_is_far_from_tipping_over_and_limits_can_be_given() -> None:
    robot, straight = paper(), MotionLimits.of_robot(paper())
    turning = MotionLimits.of_turning(robot, straight.speed)
    tips_over = 9.81 * 0.5 * robot.track / (robot.com_height + robot.wheel_radius)
    assert straight.speed * turning.speed == pytest.approx(0.25 * tips_over, rel=1e-3)
    assert turning.acceleration <= 0.5 * TURNING_SHARE * 20.0 * yaw_mobility(robot)
    given = MotionLimits.of_turning(robot, 1.0, 0.5, 0.25)
    assert (given.speed, given.acceleration) == (0.5, 0.25)


def test_a_turn_has_its_full_rate_after_three_falling_times_where_the_torque_is_enough() -> None:
    robot, straight = paper(torque_limit=1e4), MotionLimits.of_robot(paper())
    turning = MotionLimits.of_turning(robot, straight.speed)
    profile = profile_to_speed(Motion(), turning.speed, turning)
    assert profile.duration == pytest.approx(3.0 * falling_time(robot))
    assert profile.phases[0].duration == pytest.approx(falling_time(robot))
    wide = MotionLimits.of_turning(paper(track=3.0), straight.speed)
    assert wide.speed * 1.5 == pytest.approx(0.5 * straight.speed)  # of each wheel, on the spot


def heading_course(segments: list[dict[str, float]], **settings: float) -> HeadingCourse:
    course = Course.from_settings(paper(), segments, **settings)  # type: ignore[arg-type]
    assert course.heading is not None
    return course.heading


def test_headings_add_up_and_stay_while_the_robot_drives() -> None:
    asked = heading_course(
        [{"turn": 90}, {"seconds": 2.0, "speed": 0.3}, {"turn": -180}, {"seconds": 1.0, "speed": 0.0}]
    )
    targets = [asked.target(segment.begin) for segment in asked.segments]
    assert [target.position for target in targets] == pytest.approx(
        np.radians([90, 90, 90, -90, -90])
    )  # it stops first
    assert asked.target(1e9) == Target(None, math.radians(-90))


def test_a_turn_without_a_time_takes_as_long_as_its_reference() -> None:
    asked = heading_course([{"turn": 90}])
    profile = profile_to_position(Motion(), math.radians(90.0), asked.limits)
    assert asked.segments[0].end == pytest.approx(profile.duration)


def test_a_turn_begins_when_the_reference_stands() -> None:
    course = Course.from_settings(paper(), [{"seconds": 5.0, "speed": 0.5}, {"turn": 90}])
    assert [segment.target.heading for segment in course.segments] == [0.0, 0.0, math.radians(90.0)]
    assert course.segments[1].target.speed == 0.0
    assert course.turns and not Course.from_settings(paper(), [{"position": 1.0}]).turns


def test_wheel_radii_are_places_for_robots_of_all_sizes() -> None:
    course = Course.from_settings(paper(), [{"radii": 7}])
    assert course.segments[0].target == Target(None, pytest.approx(1.05))  # type: ignore[arg-type]


@pytest.mark.parametrize("segment", [{"turn": math.nan}, {"turn": 90, "speed": 1.0}, {"turn": 90, "seconds": 0.0}])
def test_turns_that_cannot_be_are_refused(segment: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match="Segment 0 of the course is"):
        Course.from_settings(paper(), [segment])


def test_without_control_of_the_heading_a_course_has_none() -> None:
    assert Course.from_settings(paper(), [{"turn": 90}], control_heading=False).heading is None


def test_the_rate_is_that_of_the_wheels_angles_where_nothing_measures_it() -> None:
    robot = paper()
    estimate, told = HeadingEstimate(robot, has_gyro=False), HeadingEstimate(robot, has_gyro=False)
    for k in range(50):
        time = 0.02 * k
        apart = WheelDifference(0.5 * time**2, time)
        told.follow(time, math.nan, apart, stands=False)
        estimate.follow(time, math.nan, apart._replace(rate=math.nan), stands=False)
    assert estimate.heading == told.heading
    assert estimate.rate == pytest.approx(told.rate, rel=0.02)
