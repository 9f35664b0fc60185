"""A robot that was changed shows, when it is driven, what it was changed by."""

import numpy as np
import pytest

from twbal.core.start_pose import StartPose
from twbal.virtual_robot.ground_truth import Noise
from twbal.virtual_robot.mujoco_robot import MujocoRobot
from twbal.virtual_robot.perturbed import (
    Signs,
    with_delay,
    with_model_error,
    with_motor_lag,
    with_sensor_noise,
    with_torque_noise,
)
from twbal.virtual_robot.pushed_robot import PushedRobot

PERIOD = 0.02


@pytest.fixture
def of(paper):
    """The robot of a truth, upright and at rest."""

    def build(truth, tilt=0.0):
        start = StartPose(tilt, 0.0, 0.0, 0.0)
        return MujocoRobot(truth=truth, control_period=PERIOD, start=start, physics_step=0.00025, seed=3)

    return build


@pytest.fixture
def ideal(make):
    return make().truth


def turning(robot, command, periods):
    """(periods + 1,) rate of the wheels under one command [rad/s]."""
    return np.array([robot.reset(0).wheel_rate, *(robot.step(command).wheel_rate for _ in range(periods))])


def test_a_delay_shows_as_the_time_from_a_command_to_the_first_motion(of, ideal):
    for delay in (0.0, 0.04, 0.1):
        moves = np.abs(turning(of(with_delay(ideal, delay)), 2.0, 12)) > 1e-6
        assert int(np.argmax(moves)) == 1 + round(delay / PERIOD)


def test_a_delay_is_added_to_the_robots_own(of, ideal):
    twice = turning(of(with_delay(with_delay(ideal, 0.03), 0.05)), 2.0, 9)
    np.testing.assert_allclose(twice, turning(of(with_delay(ideal, 0.08)), 2.0, 9), atol=1e-9)


def test_a_lagging_motor_has_given_the_wheel_what_a_first_order_lag_gives_it(of, ideal):
    """Impulse of a step of torque by t: 1 - T/t (1 - exp(-t/T)) of the full one; the wheel turns in proportion."""
    lag, t = 0.05, PERIOD
    full, lagging = (turning(of(truth), 0.2, 1)[1] for truth in (ideal, with_motor_lag(ideal, lag)))
    assert lagging / full == pytest.approx(1.0 - lag / t * (1.0 - np.exp(-t / lag)), rel=0.03)


@pytest.mark.slow
def test_random_torque_is_white_with_its_deviation_and_does_what_such_a_command_does(of, ideal):
    """With ideal motors, commands of the same size move the robot as the random torque does, to rounding."""
    noisy, quiet = of(with_torque_noise(ideal, 1.5)), of(ideal)
    noisy.reset(7)
    quiet.reset(7)
    drawn = []
    for _ in range(1500):
        if len(drawn) % 20 == 0:
            noisy.reset(7 + len(drawn))
            quiet.reset(7 + len(drawn))
        drawn.append(2.0 * noisy._memory.random_torque[0])
        np.testing.assert_allclose(noisy.step(0.0), quiet.step(drawn[-1]), atol=1e-9)
    assert np.std(drawn) == pytest.approx(1.5, rel=0.08)
    assert abs(np.corrcoef(drawn[:-1], drawn[1:])[0, 1]) < 0.1


def test_a_robot_without_random_torque_is_what_it_was(of, ideal):
    np.testing.assert_array_equal(turning(of(with_torque_noise(ideal, 0.0)), 1.0, 20), turning(of(ideal), 1.0, 20))


def test_added_sensor_noise_is_seen_in_what_is_shown_of_a_still_robot(of, ideal):
    more = Noise(0.03, 0.2, 0.5, 0.01, 0.4, 0.1)
    robot = of(with_sensor_noise(with_sensor_noise(ideal, more), more))
    shown = np.array([robot.reset(trial) for trial in range(1500)])
    expected = np.sqrt(2.0) * np.array([0.03, 0.2, 0.5, 0.01, 0.4, 0.1])
    np.testing.assert_allclose(shown[:, 1:].std(0), expected, rtol=0.08)


@pytest.mark.parametrize("signs", [Signs(1.0, -1.0, 1.0), Signs(-1.0, 1.0, -1.0)])
def test_a_model_error_changes_how_the_robot_falls_and_is_driven(signs, of, ideal):
    """Let go at a small tilt, θ̈ = (M m g l) θ / (M (I + m l²) - m² l²), M = m + 2 (m_w + I_w / r²); and gains scale."""
    share = 0.3
    truth = with_model_error(ideal, share, signs)
    body = ideal.body
    m, length = body.mass * (1 + share * signs.mass), body.com_height * (1 + share * signs.com_height)
    inertia, r = body.inertia[1] * (1 + share * signs.mass), body.wheel_radius[0]
    whole = m + 2.0 * (body.wheel_mass + body.wheel_inertia / r**2)
    robot, tilt = of(truth, 0.01), 0.01
    robot.reset(0)
    robot.step(0.0)
    growing = whole * m * 9.81 * length * tilt / (whole * (inertia + m * length**2) - (m * length) ** 2)
    assert robot.true_motion.tilt_rate / PERIOD == pytest.approx(growing, rel=0.02)
    assert np.mean(truth.drive.gain) == pytest.approx(1 + share * signs.torque_gain)


def test_a_push_gives_its_impulse_forward_in_even_trials_and_backward_in_odd_ones(of, ideal):
    forces = []

    class Recorded(MujocoRobot):
        def step(self, command):
            forces.append(self.push)
            return super().step(command)

    start = StartPose(0.0, 0.0, 0.0, 0.0)
    robot = Recorded(truth=ideal, control_period=PERIOD, start=start, physics_step=0.00025, seed=3)
    for trial, sign in ((4, 1.0), (5, -1.0)):
        pushed = PushedRobot(robot, 0.2, 0.1, 8.0)
        pushed.reset(trial)
        forces.clear()
        for _ in range(30):
            pushed.step(0.0)
        assert sum(forces) * PERIOD == pytest.approx(sign * 8.0)
        assert [number for number, force in enumerate(forces) if force] == list(range(pushed.begin, pushed.end))
        assert (pushed.begin, pushed.end) == (10, 15)
