"""Lean, way and torque that a reference's acceleration needs, by the equations of motion."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import solve_continuous_are

from twbal.core.channels import Channels, StateTracker
from twbal.core.course import Target
from twbal.core.feed_forward import NO_OFFSET, FeedForward, FeedForwardGenerator, added
from twbal.core.gaussian import Array
from twbal.core.motion_limits import MotionLimits
from twbal.core.motion_profile import Motion, profile_to_speed
from twbal.core.plant import Observation
from twbal.core.reference import Reference
from twbal.core.robot_parameters import RobotParameters

PERIOD, RADIUS = 0.02, 0.15
A, B, C, WEIGHT = 12.0 * RADIUS**2 + 2 * 0.0125, 10.0 * 0.3 * RADIUS, 0.319 + 10.0 * 0.3**2, 10.0 * 9.81 * 0.3
"""a, b, c [kg·m²] and m g l [N·m] of the paper's robot, by hand."""


@pytest.fixture
def robot() -> RobotParameters:
    values = {"body_mass": 10.0, "com_height": 0.3, "com_offset": 0.0, "body_inertia_pitch": 0.319}
    values |= {"body_inertia_roll": 0.433, "body_inertia_yaw": 0.152, "wheel_mass": 1.0, "wheel_radius": RADIUS}
    values |= {"wheel_inertia": 0.0125, "wheel_width": 0.04, "track": 0.45, "torque_limit": 20.0}
    return RobotParameters(name="paper", **values, control_period=PERIOD)


def test_an_offset_satisfies_both_equations_of_motion(robot: RobotParameters) -> None:
    """While the acceleration grows steadily: φ̈ and θ̈ by second differences of way and lean."""
    forward, step, jerk = FeedForward.of_robot(robot), 0.01, 0.8

    def wheel_and_lean(time: float) -> tuple[float, float]:
        offset = forward.offset(jerk * time, jerk)
        return (jerk * time**3 / 6.0 + offset.position) / RADIUS, offset.tilt

    before, now, after = (np.array(wheel_and_lean(0.3 + shift)) for shift in (-step, 0.0, step))
    turning, tipping = (before - 2.0 * now + after) / step**2
    torque = forward.offset(jerk * 0.3, jerk).torque
    assert A * turning + B * tipping == pytest.approx(torque)
    assert B * turning + C * tipping - WEIGHT * now[1] == pytest.approx(-torque)
    offset, (_, earlier) = forward.offset(jerk * 0.3, jerk), wheel_and_lean(0.3 - 1e-6)
    assert offset.tilt_rate == pytest.approx((now[1] - earlier) / 1e-6, rel=1e-4)
    assert offset.speed == pytest.approx((offset.position - forward.offset(jerk * (0.3 - 1e-6), jerk).position) / 1e-6)


def farthest_from_the_reference(robot: RobotParameters, forward: FeedForward | None) -> float:
    """Of a regulated robot on its way to 0.8 m/s, the equations of motion being integrated by scipy [m]."""
    inverse = np.linalg.inv([[A, B], [B, C]])
    dynamics, given = np.zeros((4, 4)), np.zeros(4)  # of (way, lean, speed, tilt rate), the way in wheel angles
    dynamics[:2, 2:], dynamics[2:, 1], given[2:] = np.eye(2), inverse @ [0.0, WEIGHT], inverse @ [1.0, -1.0]
    cost = solve_continuous_are(dynamics, given[:, None], np.diag([1.0, 1.0, 1.0, 1.0]), [[1.0]])
    gain = given @ cost
    profile = profile_to_speed(Motion(), 0.8, MotionLimits.of_robot(robot))
    generator = FeedForwardGenerator(forward or nothing())
    state, off = np.zeros(4), []
    for time in np.arange(0.0, 5.0, PERIOD).tolist():
        asked = profile.at(time)
        offset = generator.follow(asked.speed, PERIOD if time else 0.0)
        wanted = [(asked.position + offset.position) / RADIUS, offset.tilt]
        wanted += [(asked.speed + offset.speed) / RADIUS, offset.tilt_rate]
        command = offset.torque - gain @ (state - wanted)
        found = solve_ivp(lambda _, x, u=command: dynamics @ x + given * u, (0.0, PERIOD), state, rtol=1e-8)
        off.append(RADIUS * state[0] - asked.position)
        state = found.y[:, -1]
    return float(np.abs(off).max())


def nothing() -> FeedForward:
    return FeedForward(0.0, 0.0, 0.0, 1.0, 1.0)


def test_a_regulated_robot_follows_a_ramp_many_times_closer_with_it(robot: RobotParameters) -> None:
    without, with_it = (farthest_from_the_reference(robot, each) for each in (None, FeedForward.of_robot(robot)))
    assert without > 0.15
    assert with_it < 0.05  # of which 0.03 m are the axle behind the leaning body


def test_accelerations_are_those_of_the_reference_half_a_period_before(robot: RobotParameters) -> None:
    profile, forward = profile_to_speed(Motion(), 0.8, MotionLimits(1.0, 0.5, 2.0)), FeedForward.of_robot(robot)
    generator = FeedForwardGenerator(forward)
    for time in np.arange(0.0, 2.2, PERIOD).tolist():
        found = generator.follow(profile.at(time).speed, PERIOD if time else 0.0)
        if time:
            assert found.acceleration == pytest.approx(profile.at(time - 0.5 * PERIOD).acceleration, abs=6e-3)
    assert found == generator.offsets[-1] == pytest.approx(NO_OFFSET, abs=1e-9)


def test_a_jump_of_the_speed_is_not_fed_forward(robot: RobotParameters) -> None:
    """As where a robot's host falls silent: within one period the reference is at rest."""
    generator = FeedForwardGenerator(FeedForward.of_robot(robot))
    found = [generator.follow(speed, PERIOD) for speed in (0.0, 0.5 * PERIOD, 0.8, 0.0, 0.0)]
    assert found[1].acceleration == pytest.approx(0.5)
    assert found[2:] == [NO_OFFSET] * 3


class Asked:
    """A speed, as soon as may be."""

    limits, give_way = MotionLimits(1.0, 0.5, 2.0), 5.0

    def __init__(self, speed: float) -> None:
        self._speed = speed

    def target(self, time: float) -> Target:
        return Target(self._speed)


NAMES = ("tilt", "tilt_rate", "acceleration", "speed", "command_1", "position", "position_integral")
ALL = Channels(NAMES, RADIUS, PERIOD)


def states(robot: RobotParameters, speed: float | None, forward: FeedForward | None) -> tuple[Array, list[float]]:
    """What a policy sees of a robot that is driven at random, and the torques that are added."""
    rng = np.random.default_rng(5)
    tracker = StateTracker(ALL, None if speed is None else Reference(Asked(speed)), forward)
    found, commands, torques = [], [], []
    for time in np.arange(0.0, 1.0, PERIOD).tolist():
        tracker.state(Observation(time, *rng.normal(size=6) * 0.1), commands)
        found.append(tracker.for_policy)
        torques.append(tracker.offset.torque)
        commands.append(float(rng.normal()))
    return np.array(found), torques


@pytest.mark.parametrize("speed", [None, 0.0])
def test_without_a_moving_reference_no_bit_of_a_state_changes(robot: RobotParameters, speed: float | None) -> None:
    with_it, torques = states(robot, speed, FeedForward.of_robot(robot))
    assert with_it.tobytes() == states(robot, None, None)[0].tobytes()
    assert not any(torques)
    assert added(-0.3, 0.0, 20.0) == -0.3


def test_the_state_is_less_what_goes_with_the_acceleration_and_commands_less_what_was_added(
    robot: RobotParameters,
) -> None:
    forward = FeedForward.of_robot(robot)
    with_it, torques = states(robot, 0.8, forward)
    offset = states(robot, 0.8, None)[0] - with_it
    gained = np.array(torques) / forward.torque
    np.testing.assert_allclose(offset[:, 0], forward.lean * gained, atol=1e-12)
    np.testing.assert_allclose(offset[:, 2], gained, atol=1e-12)
    np.testing.assert_allclose(offset[1:, 4], torques[:-1], atol=1e-12)
    np.testing.assert_allclose(offset[:, 5], -forward.height * offset[:, 0], atol=1e-12)
    assert gained.max() == pytest.approx(0.5, abs=0.01)


def test_what_is_recorded_is_less_the_reference_alone(robot: RobotParameters) -> None:
    with_it, without = (StateTracker(ALL, Reference(Asked(0.8)), each) for each in (FeedForward.of_robot(robot), None))
    for time in np.arange(0.0, 1.0, PERIOD).tolist():
        seen = Observation(time, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
        found, expected = (tracker.state(seen, [1.0])[:-1] for tracker in (with_it, without))
        assert found.tolist() == expected.tolist()


def test_what_is_added_is_cut_to_the_largest_command() -> None:
    assert [added(each, 1.5, 20.0) for each in (0.2, 19.0, -21.0)] == [1.7, 20.0, -19.5]
