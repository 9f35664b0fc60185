from collections.abc import Callable, Iterator

import numpy as np
import pytest

from twbal.core.channels import DRIVING_INTEGRAL, Channels, StateTracker
from twbal.core.course import AT_REST, Course, Standing, Target
from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array
from twbal.core.motion_limits import MotionLimits
from twbal.core.motion_profile import Motion
from twbal.core.plant import Observation
from twbal.core.reference import LARGEST_SLIP, Reference, Targets
from twbal.core.robot_parameters import GRAVITY, RobotParameters

LIMITS = MotionLimits(speed=1.0, acceleration=0.5, jerk=2.0)
RADIUS, PERIOD, GIVE_WAY = 0.15, 0.02, 0.4
PLACE = Channels(("tilt", "speed", "position", "position_integral"), RADIUS, PERIOD)


class Asked:
    """A speed from some time on, and rest before."""

    limits, give_way = LIMITS, GIVE_WAY

    def __init__(self, speed: float | None, position: float = 0.0, since: float = 0.0) -> None:
        self._target, self._since = Target(speed, position), since

    def target(self, time: float) -> Target:
        return self._target if time >= self._since else AT_REST


class Stop(Asked):
    """That speed for five seconds, and rest."""

    def target(self, time: float) -> Target:
        return AT_REST if time >= 5.0 else super().target(time)


def followed(reference: Reference, robot: Callable[[float], float], until: float) -> Iterator[Array]:
    """Time, the robot's place and the reference, at each instant of a robot that goes its own way."""
    for time in np.arange(0.0, until, PERIOD).tolist():
        yield np.array([time, robot(time), *reference.follow(time, robot(time), 0.0)])


def paper(**other: float) -> RobotParameters:
    values = {"body_mass": 10.0, "com_height": 0.3, "com_offset": 0.0, "body_inertia_pitch": 0.319}
    values |= {"body_inertia_roll": 0.433, "body_inertia_yaw": 0.152, "wheel_mass": 1.0, "wheel_radius": 0.15}
    values |= {"wheel_inertia": 0.0125, "wheel_width": 0.04, "track": 0.45, "torque_limit": 20.0}
    return RobotParameters(name="paper", **values | {"control_period": 0.02} | other)


def test_a_robot_that_follows_never_makes_the_reference_give_way() -> None:
    reference = Reference(Asked(0.8))
    rows = np.array(list(followed(reference, lambda t: 0.8 * max(t - 0.9, 0.0), 6.0)))
    assert not reference.events
    np.testing.assert_allclose(rows[-1, 3:], [0.8, 0.0], atol=1e-9)
    assert rows[-1, 2] == pytest.approx(0.8 * (rows[-1, 0] - 0.5 * (0.8 / 0.5 + 0.5 / 2.0)))  # of the trapezoid


def test_before_a_held_robot_the_reference_stops_at_the_greatest_distance_and_comes_to_rest() -> None:
    reference = Reference(Asked(0.8))
    rows = np.array(list(followed(reference, lambda t: 0.0, 12.0)))
    assert rows[:, 2].max() == pytest.approx(GIVE_WAY)
    assert rows[-1, 2:] == pytest.approx([GIVE_WAY, 0.0, 0.0], abs=1e-9)
    assert reference.gives_way and [event.text for event in reference.events] == ["the reference gives way"]
    assert (np.abs(np.diff(rows[:, 3])) <= 0.5 * PERIOD + 1e-9).all()  # also in giving way


def test_a_robot_that_is_let_go_is_led_on_from_where_it_is_within_the_limits() -> None:
    def robot(time: float) -> float:
        return 0.0 if time < 6.0 else min(0.3 * (time - 6.0), GIVE_WAY) if time < 8.0 else 0.4 + 0.7 * (time - 8.0)

    reference = Reference(Asked(0.8))
    rows = np.array(list(followed(reference, robot, 16.0)))
    assert [event.text for event in reference.events[:2]] == ["the reference gives way", "the reference goes on"]
    on = rows[:, 0] >= reference.events[1].time
    assert rows[on][0, 2] == pytest.approx(GIVE_WAY)  # what was lost is not made up for
    assert (np.abs(np.diff(rows[:, 3])) <= 0.5 * PERIOD + 1e-9).all()
    assert rows[:, 3].max() == pytest.approx(0.8)


def test_a_pushed_robot_drags_the_place_along_and_a_place_that_was_asked_for_is_gone_back_to() -> None:
    def robot(time: float) -> float:
        return 1.0 if 2.0 <= time < 4.0 else (0.7 if 4.0 <= time < 5.0 else 0.0)

    reference = Reference(Asked(None, 0.0))
    rows = np.array(list(followed(reference, robot, 4.0)))
    assert rows[-1, 2] == pytest.approx(1.0 - GIVE_WAY)
    more = np.array([[t, *reference.follow(t, 0.65 if t < 6.0 else 0.1, 0.0)] for t in np.arange(4.0, 12.0, PERIOD)])
    assert more[-1, 1:] == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize("speed", [0.8, -0.8])
def test_a_robot_that_overtakes_the_reference_drags_its_place_along_and_does_not_bring_it_to_rest(speed: float) -> None:
    def robot(time: float) -> float:
        return speed * (time + max(min(time, 5.0) - 4.0, 0.0))  # it leaps ahead between 4 and 5 s

    reference = Reference(Asked(speed))
    rows = np.array(list(followed(reference, robot, 10.0)))
    assert not reference.events and not reference.gives_way
    at_speed = rows[rows[:, 0] > 3.0]
    assert np.abs(at_speed[:, 1] - at_speed[:, 2]).max() == pytest.approx(GIVE_WAY)
    np.testing.assert_allclose(at_speed[:, 3], speed, atol=1e-9)


@pytest.mark.parametrize(
    ("leads", "place", "rests"),
    [(False, 1.0, False), (False, 0.95, False), (False, 0.85, True), (True, 0.85, False), (True, 0.2, True)],
)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_robot_that_overtakes_is_led_on_where_its_place_is_far_or_where_that_is_asked_for_until_it_is_there(
    leads: bool, place: float, rests: bool, side: float
) -> None:
    """It leaps to 0.5 m while the reference is on its way, slowly still; a place at 0.2 m it has passed."""
    reference = Reference(Asked(None, side * place), leads_all_the_way=leads)
    for time in np.arange(0.0, 0.4, PERIOD).tolist():
        reference.follow(time, 0.0, 0.0)
    reference.follow(0.4, side * 0.5, 0.0)
    braking = reference.motion.speed**2 / (2.0 * LIMITS.acceleration)
    assert 0.0 < side * reference.motion.position < 0.2 and 1e-4 < braking < 0.03
    assert reference.gives_way == rests


def test_the_faster_the_reference_the_farther_from_its_place_it_rests_for_a_robot_that_overtakes_it() -> None:
    """At 1 m/s it needs 1 m to come to rest; the robot leaps ahead to 4 m."""

    def leapt(left: float) -> Reference:
        reference = Reference(Asked(None, 4.0 + left))
        rows = followed(reference, lambda t: reference.motion.position, 4.0)
        end = np.array(list(rows))[-1]
        assert end[3] == pytest.approx(LIMITS.speed)
        reference.follow(4.0, 4.0, LIMITS.speed)
        return reference

    to_rest = LIMITS.speed**2 / (2.0 * LIMITS.acceleration)
    assert not leapt(to_rest + GIVE_WAY + 0.05).gives_way
    assert leapt(to_rest + GIVE_WAY - 0.05).gives_way


def test_a_reference_that_rests_for_a_robot_goes_on_when_that_overtakes_it() -> None:
    reference = Reference(Asked(0.8))
    behind = np.array(list(followed(reference, lambda t: 0.0, 1.4)))
    assert reference.gives_way and behind[-1, 3] > 0.1
    reference.follow(1.4, reference.motion.position + 1.1 * GIVE_WAY, 0.0)
    assert not reference.gives_way and reference.events[-1].text == "the reference goes on"


def test_a_stop_that_is_asked_for_is_obeyed_while_the_robot_is_ahead() -> None:
    reference = Reference(Stop(0.8))
    rows = np.array(list(followed(reference, lambda t: 0.8 * t + GIVE_WAY if t < 5.0 else 4.0 + GIVE_WAY, 9.0)))
    assert rows[-1, 3:] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert (np.abs(np.diff(rows[:, 3])) <= 0.5 * PERIOD + 1e-9).all()


def seen_at(time: float, path: float, speed: float, tilt: float) -> Observation:
    return Observation(time, tilt, 0.0, 0.0, path / RADIUS - tilt, speed / RADIUS, 0.0)


@pytest.mark.parametrize(("share", "goes_on"), [(0.45, 0.1), (0.7, 1.1), (0.9, None), (1.2, None)])
def test_a_robot_that_stands_near_enough_is_led_on_and_one_that_is_held_farther_off_is_not(
    share: float, goes_on: float | None
) -> None:
    """It is thrown beyond the greatest distance, and then stands at a share of it, as on a slope."""
    reference, thrown = Reference(Asked(None, 1.0, since=2.0)), 1.0
    rows = followed(reference, lambda t: -1.1 * GIVE_WAY if t < thrown else -share * GIVE_WAY - 0.1 * GIVE_WAY, 6.0)
    places = np.array(list(rows))[:, 2]
    texts = [event.text for event in reference.events]
    if goes_on is None:
        assert texts == ["the reference gives way"]
        assert places[-1] <= 0.0
    else:
        assert texts[:2] == ["the reference gives way", "the reference goes on"]
        assert reference.events[1].time == pytest.approx(thrown + goes_on, abs=0.2)
        assert places.max() > 0.0  # on its way to the place that was asked for


def test_errors_are_what_a_frame_that_moves_with_the_reference_shows() -> None:
    """The same wiggle about a standing and about a moving place gives the same states, but for the faster integral."""
    moving, still = StateTracker(PLACE, reference := Reference(Asked(0.6))), StateTracker(PLACE)
    planned = Reference(Asked(0.6))
    integral, off, was_moving = 0.0, 0.0, False
    for time in np.arange(0.0, 8.0, PERIOD).tolist():
        place, speed = 0.05 * np.sin(3.0 * time), 0.15 * np.cos(3.0 * time)
        motion = planned.follow(time, *planned.motion[:2])
        seen = seen_at(time, motion.position + place, motion.speed + speed, 0.02)
        expected = still.state(seen_at(time, place, speed, 0.02), [])
        integral += PERIOD * off * (DRIVING_INTEGRAL if was_moving else 1.0) if time else 0.0
        off, was_moving = place, motion.speed > 0.0
        np.testing.assert_allclose(moving.state(seen, []), [*expected[:3], integral], atol=1e-9)
    assert reference.motion.speed == pytest.approx(0.6)


def test_friction_is_made_up_for_sooner_while_the_reference_moves() -> None:
    """A robot that stays 5 cm ahead."""
    tracker = StateTracker(PLACE, reference := Reference(Stop(0.8)))
    planned, rows = Reference(Stop(0.8)), []
    for time in np.arange(0.0, 12.0, PERIOD).tolist():
        motion = planned.follow(time, *planned.motion[:2])
        state = tracker.state(seen_at(time, motion.position + (0.05 if time else 0.0), motion.speed, 0.0), [])
        rows.append((motion.speed, state[3]))
    speeds, integrals = np.array(rows)[1:].T
    grown = np.diff(integrals) / (PERIOD * 0.05)
    assert not reference.events
    assert grown[speeds[:-1] > 0.0] == pytest.approx(DRIVING_INTEGRAL)
    assert grown[speeds[:-1] == 0.0] == pytest.approx(1.0)


def test_where_the_encoders_began_to_count_does_not_matter() -> None:
    at_zero, elsewhere = (StateTracker(PLACE, Reference(Asked(0.6))) for _ in range(2))
    for time in np.arange(0.0, 4.0, PERIOD).tolist():
        seen = seen_at(time, 0.5 * time, 0.5, 0.1)
        shifted = seen._replace(wheel_angle=seen.wheel_angle + 100.0)
        np.testing.assert_allclose(elsewhere.state(shifted, []), at_zero.state(seen, []), atol=1e-9)


def test_a_reference_at_rest_changes_no_state_of_a_robot_that_is_near() -> None:
    """Within a wheel radius."""
    rng = np.random.default_rng(3)
    with_one, without = StateTracker(PLACE, Reference(Asked(0.0))), StateTracker(PLACE)
    for time in np.arange(0.0, 4.0, PERIOD).tolist():
        seen = seen_at(time, *rng.uniform(-0.4 * RADIUS, 0.4 * RADIUS, 2), 0.1)
        assert with_one.state(seen, []).tolist() == without.state(seen, []).tolist()


def integrals_behind_rest(place: float, seconds: float) -> Array:
    """Of a robot that is put down and stands at `place` from then on, behind a reference at rest."""
    tracker = StateTracker(PLACE, reference := Reference(Asked(0.0)))
    times = np.arange(0.0, seconds, PERIOD).tolist()
    found = [tracker.state(seen_at(time, place if time else 0.0, 0.0, 0.0), [])[3] for time in times]
    assert not reference.events
    return np.array(found)


@pytest.mark.parametrize(
    ("place", "rate"), [(0.9, 1.0), (-0.9, 1.0), (1.1, DRIVING_INTEGRAL), (-1.1, DRIVING_INTEGRAL)]
)
def test_a_slope_is_made_up_for_sooner_where_the_robot_is_more_than_a_wheel_radius_off(
    place: float, rate: float
) -> None:
    place *= PLACE.wheel_radius
    grown = np.diff(integrals_behind_rest(place, 2.0))[1:] / (PERIOD * place)
    assert grown == pytest.approx(rate)


def test_the_integral_is_held_while_the_reference_gives_way() -> None:
    tracker = StateTracker(PLACE, reference := Reference(Asked(0.8)))
    integrals, giving = [], []
    for time in np.arange(0.0, 20.0, PERIOD).tolist():
        integrals.append(tracker.state(seen_at(time, 0.0, 0.0, 0.0), [])[3])
        giving.append(reference.gives_way)
    first = giving.index(True)
    assert 0 < first < 200 and all(giving[first:])
    assert len({*integrals[first + 1 :]}) == 1
    assert abs(integrals[-1]) < 0.5 < PLACE.max_position_integral


class Pushed:
    """A robot that stands, is pushed at 4 s for 0.1 s, and brakes towards its reference's speed and place."""

    def __init__(self, push: float) -> None:
        self._push, self.place, self.speed = push, 0.0, 0.0

    def step(self, time: float, asked: Motion) -> None:
        if 4.0 - 1e-9 <= time < 4.1 - 1e-9:
            self.speed += PERIOD * self._push / 0.1
        self.speed += PERIOD * (3.0 * (asked.speed - self.speed) + 3.0 * (asked.position - self.place))
        self.place += PERIOD * self.speed


def pushed(push: float, targets: Targets, most_taken: float = 1.0) -> tuple[Reference, Array]:
    """The reference, and rows of the robot's place and speed and the reference's, in 16 s."""
    reference, robot, rows = Reference(targets, most_taken=most_taken), Pushed(push), []
    for time in np.arange(0.0, 16.0, PERIOD).tolist():
        asked = reference.follow(time, robot.place, robot.speed)
        rows.append((robot.place, robot.speed, *asked))
        robot.step(time, asked)
    return reference, np.array(rows)


@pytest.mark.parametrize("push", [1.4, -1.4, 2.0])
def test_a_push_takes_the_reference_along_which_then_brakes_within_its_limits_and_comes_back(push: float) -> None:
    reference, rows = pushed(push, Standing(LIMITS, give_way=2.0))
    jumps = PERIOD * np.flatnonzero(np.abs(np.diff(rows[:, 3])) > LIMITS.acceleration * PERIOD + 1e-9)
    assert len(jumps) and jumps.min() > 4.0 and jumps.max() < 4.6
    assert np.abs(rows[-1, :4]) == pytest.approx([0.0] * 4, abs=0.02)
    told = [event for event in reference.events if "is pushed" in event.text]
    assert len(told) == 1 and told[0].time == pytest.approx(4.1, abs=0.04)


def test_while_it_is_pushed_a_robot_is_faster_than_its_reference_by_half_the_speed_limit_at_most() -> None:
    _, rows = pushed(1.5, Standing(LIMITS, give_way=2.0))
    slips = np.abs(rows[:, 1] - rows[:, 3])
    just_pushed = slice(round(4.1 / PERIOD) + 1, round(4.5 / PERIOD))
    assert 0.4 < slips[just_pushed].max() <= LARGEST_SLIP * LIMITS.speed + 1e-9


def test_a_push_while_driving_does_not_change_where_a_speed_leads() -> None:
    _, rows = pushed(-1.6, Asked(0.6))
    assert rows[:, 3].min() < 0.0  # it was thrown back
    assert rows[-1, 3:5] == pytest.approx([0.6, 0.0], abs=1e-9)


@pytest.mark.parametrize("most_taken", [1.0, 1.5])
def test_a_reference_takes_on_no_more_than_so_many_times_its_speed_limit(most_taken: float) -> None:
    _, rows = pushed(4.0, Asked(0.6), most_taken)
    assert rows[:, 3].max() == pytest.approx(most_taken * LIMITS.speed)
    assert rows[-1, 3] == pytest.approx(0.6, abs=1e-9)


@pytest.mark.parametrize("push", [0.9, -0.9])
def test_a_light_push_is_left_to_the_policy(push: float) -> None:
    reference, rows = pushed(push, Standing(LIMITS, give_way=2.0))
    assert not reference.events
    assert not rows[:, 2:].any()


def test_a_reference_takes_on_no_speed_where_that_is_not_asked_for() -> None:
    reference = Reference(Standing(LIMITS, give_way=2.0))
    assert all(not any(reference.follow(time, 0.0, 5.0 * (time > 3.0))) for time in np.arange(0.0, 3.1, PERIOD))


# Limits of the sheet, and courses


def test_the_acceleration_of_the_sheet_needs_a_lean_of_five_degrees_in_the_equations_of_motion() -> None:
    robot = paper()
    limits = MotionLimits.of_robot(robot)
    turning = limits.acceleration / robot.wheel_radius  # both equations with a constant lean
    a = (10.0 + 2.0) * 0.15**2 + 2 * 0.0125
    b, d, lean = 10.0 * 0.3 * 0.15, 10.0 * GRAVITY * 0.3, np.radians(5.0)
    torque = a * turning  # of the wheels' equation; the body's:
    assert b * np.cos(lean) * turning - d * np.sin(lean) == pytest.approx(-torque)
    assert 0.45 < limits.acceleration < 0.55 and 1.0 < limits.speed < 1.1


def test_weak_motors_limit_the_acceleration_by_their_torque() -> None:
    weak = MotionLimits.of_robot(paper(torque_limit=1.0))
    a = (10.0 + 2.0) * 0.15**2 + 2 * 0.0125
    assert weak.acceleration == pytest.approx(0.25 * 1.0 / a * 0.15)
    assert weak.jerk < MotionLimits.of_robot(paper()).jerk


def test_robots_of_one_shape_have_limits_of_one_shape() -> None:
    """Froude's scaling: lengths times 4 make speeds twice as large, and accelerations the same."""
    scale = {"wheel_radius": 0.6, "com_height": 1.2}
    scale |= {"body_inertia_pitch": 0.319 * 16, "body_inertia_roll": 0.433 * 16, "body_inertia_yaw": 0.152 * 16}
    small, large = MotionLimits.of_robot(paper()), MotionLimits.of_robot(paper(**scale, wheel_inertia=0.2))
    assert large.speed == pytest.approx(2 * small.speed)
    assert large.acceleration == pytest.approx(small.acceleration)
    assert large.jerk == pytest.approx(small.jerk / 2)


def test_given_limits_take_the_place_of_those_of_the_sheet() -> None:
    assert MotionLimits.of_robot(paper(), 2.0, 3.0, 4.0) == MotionLimits(2.0, 3.0, 4.0)


def course(*segments: dict[str, float], **settings: float) -> Course:
    return Course.from_settings(paper(), segments, **settings)


def test_a_course_asks_for_each_segment_in_its_time_and_a_place_takes_as_long_as_the_way() -> None:
    found = course({"seconds": 2.0, "speed": 0.5}, {"position": 0.0}, {"seconds": 1.0, "share": -0.5}, speed_limit=0.8)
    assert [found.target(t) for t in (0.0, 1.99, 2.0)] == [Target(0.5), Target(0.5), Target(None, 0.0)]
    assert found.target(99.0) == Target(-0.4)
    reference = Reference(found)
    for time in np.arange(0.0, found.segments[1].end, PERIOD).tolist():
        motion = reference.follow(time, *reference.motion[:2])
    assert motion.position == pytest.approx(0.0, abs=1e-3)
    assert found.steps(PERIOD) == pytest.approx(found.duration / PERIOD, abs=1.0)
    assert found.give_way == pytest.approx(0.3 * 0.8)


@pytest.mark.parametrize(
    "segment",
    [
        {"speed": 0.1},
        {"seconds": 1.0},
        {"seconds": 0.0, "speed": 0.1},
        {"seconds": 1.0, "speed": 0.1, "position": 1.0},
        {"seconds": 1.0, "speed": "fast"},
        {"seconds": 1.0, "speed": float("nan")},
    ],
)
def test_a_segment_that_says_too_little_or_too_much_is_refused(segment: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match=r"Segment 0 of the course is .*; expected numbers for \{seconds, speed\}"):
        course(segment)


@pytest.mark.parametrize("segment", [{"seconds": 1e9, "speed": 0.1}, {"position": 1e9}, {"turn": 1e9}])
def test_a_course_that_lasts_for_hours_is_refused_with_what_it_lasts(segment: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match=r"The course lasts \d\S+ s; expected at most 10000 s"):
        course(segment)


def test_a_speed_beyond_the_limit_is_refused_with_the_limit() -> None:
    with pytest.raises(ConfigError, match=r"asks for 3 m/s; the limit is 1.05 m/s"):
        course({"seconds": 1.0, "speed": 3.0})
    with pytest.raises(ConfigError, match="at least one segment"):
        course()
