"""A robot under an uneven loop, by matrix exponentials: its readings are predicted where they were taken."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.linalg import expm

from twbal.core.episode import Episode, Outcome, Provenance
from twbal.planar.actuation import command_between
from twbal.planar.constants import constants, with_step
from twbal.planar.linearised import linearise
from twbal.planar.parameters import planar_parameters
from twbal.sysid.kalman import kalman_filter, linearise_period
from twbal.sysid.kalman_predictor import predict, steps_behind
from twbal.sysid.noise import LASTING, NoiseModel
from twbal.sysid.open_loop import predict_open_loop
from twbal.sysid.recording import Usability, read_recordings
from twbal.sysid.uneven_loop import UnevenLoop

PERIODS, SUBSTEPS = 1000, 20
GAIN = np.array([60.0, 12.0, 4.0])  # of a regulator: tilt, tilt rate, speed
USABILITY = Usability(min_length=20, min_samples=50, max_yaw_rate=1.5, max_tilt=0.6)


def driven(robot, late, delay):
    """An episode without noise, so gentle that the equations about the balance hold.

    Args:
        robot: data sheet.
        late: (T + 1,) by which each instant comes late [s].
        delay: after which a command acts [s].
    """
    A, B = linearise(robot)
    times = robot.control_period * np.arange(PERIODS + 1) + late
    rng = np.random.default_rng(1)
    both = np.zeros((6, 6))  # tilt, tilt rate, speed, wheel angle, command
    both[:3, :3], both[:3, 4] = A, B
    both[3, 2], both[3, 1] = 1.0 / robot.wheel_radius, -1.0
    x = np.array([0.002, 0.0, 0.0, 0.0])
    rows, commands, changes = [], [], []
    for n, time in enumerate(times):
        rows.append([time, x[0] - robot.com_offset, x[1], 0.0, x[3], x[2] / robot.wheel_radius - x[1], 0.0])
        if n == PERIODS:
            break
        commands.append(float(GAIN @ x[:3]) + 0.02 * rng.standard_normal())
        changes.append(time + delay)
        at = time
        while at < times[n + 1]:  # from one change of what acts to the next
            acting = sum(change <= at + 1e-12 for change in changes[-4:]) + max(len(changes) - 4, 0)
            until = min([times[n + 1], *[change for change in changes[-4:] if change > at + 1e-12]])
            u = commands[acting - 1] if acting else 0.0
            x = (expm((until - at) * both) @ [*x, u, 0.0])[:4]
            at = until
    seen = np.array(rows)
    return Episode(
        ("tilt",), robot.control_period, seen, seen[:, 1:2], np.array(commands), Outcome.COMPLETED,
        Provenance("paper", "robot"),
    )  # fmt: skip


@pytest.mark.parametrize("delay", [0.0, 0.013])
def test_what_a_robot_shows_under_an_uneven_loop_is_predicted_as_well_as_under_an_even_one(paper, delay):
    late = 0.1 * paper.control_period * np.clip(np.random.default_rng(0).standard_normal(PERIODS + 1), -3.0, 3.0)
    late[0] = 0.0
    planar = planar_parameters(paper, {"actuation_delay": {"delay": delay}} if delay else {})
    levels = NoiseModel(np.full(4, 1e-3), np.full(2, 1e-3), np.zeros(LASTING))
    kalman = kalman_filter(linearise_period(planar, paper.control_period), levels)
    lead = 0.5 * paper.control_period / SUBSTEPS
    (even,) = read_recordings([driven(paper, np.zeros(PERIODS + 1), delay)], ["run"], paper, USABILITY)
    (recording,) = read_recordings([driven(paper, late, delay)], ["run"], paper, USABILITY)
    assert even.uneven is None and recording.uneven is not None
    off, evened = (
        predict(planar, each, SUBSTEPS, lead, kalman).errors[5:].std(axis=0)
        for each in (recording, replace(recording, uneven=None))
    )
    assert (off < 0.02 * evened).all()


def test_a_mean_of_commands_is_that_of_what_acts_from_moment_to_moment():
    rng = np.random.default_rng(2)
    instants = np.cumsum(rng.uniform(0.6, 1.4, 30))
    commands = rng.standard_normal(29)
    for _ in range(200):
        start, length = rng.uniform(-1.0, instants[-1]), rng.uniform(0.01, 3.0)
        fine = start + length * (np.arange(20_000) + 0.5) / 20_000
        numbers = np.searchsorted(instants, fine, side="right") - 1
        acting = np.where(numbers < 0, 0.0, commands[np.clip(numbers, 0, 28)])
        past = min(int(np.searchsorted(instants, start, side="right")) + int(rng.integers(2)), 28)
        assert command_between(commands, instants, past, start, length) == pytest.approx(acting.mean(), abs=1e-3)


def test_an_imu_is_late_by_a_time_whatever_the_lengths_of_the_periods():
    rng = np.random.default_rng(4)
    instants = 0.02 * np.concatenate([[0.0], np.cumsum(rng.uniform(0.6, 1.4, 20))])
    steps = np.concatenate([np.linspace(a, b, 5)[:-1] for a, b in pairwise(instants)] + [instants[-1:]])  # 4 a period
    for n in (1, 2, 5, 20):
        for delay in (0.0, 0.003, 0.013, 0.02, 0.03):
            behind = steps_behind(instants, n, delay, 0.02, 4, 16)
            before = np.arange(-20, 0) * 0.005  # as long as a mean period
            seen = np.interp(4 * n - behind, np.arange(-20, len(steps)), np.concatenate([before, steps]))
            assert seen == pytest.approx(instants[n] - delay, abs=1e-12)


def test_constants_of_another_step_are_those_that_the_model_has_at_it(paper):
    effects = {"motor_lag": {"time_constant": 0.02}, "slew_limit": {"rate": 40.0}, "actuation_delay": {"delay": 0.01}}
    for having in ({}, effects):
        planar = planar_parameters(paper, having)
        found, expected = with_step(constants(planar, 0.002), 0.0013, 0.0), constants(planar, 0.0013)
        for name, value, true in zip(expected._fields, found, expected, strict=True):
            assert value == pytest.approx(true), name


def test_open_loop_predictions_start_from_states_at_the_instants_of_an_even_loop(paper):
    """Of a robot without noise, so that all that is left of the errors is what the starts are off by."""
    late = 0.2 * paper.control_period * np.clip(np.random.default_rng(0).standard_normal(PERIODS + 1), -2.0, 2.0)
    late[0] = 0.0
    planar, ahead, starts = planar_parameters(paper, {}), 8, np.arange(100, PERIODS - 8)
    levels = NoiseModel(np.full(4, 1e-3), np.full(2, 1e-3), np.zeros(LASTING))
    kalman = kalman_filter(linearise_period(planar, paper.control_period), levels)
    errors = []
    for lateness in (np.zeros(PERIODS + 1), late):
        (recording,) = read_recordings([driven(paper, lateness, 0.0)], ["run"], paper, USABILITY)
        states = predict(planar, recording, SUBSTEPS, 0.5 * paper.control_period / SUBSTEPS, kalman).states
        for these in (states, recording.even_states(states)):
            off, seen = np.zeros((len(starts), 8)), recording.measured[starts + ahead]
            found = predict_open_loop(planar, recording, SUBSTEPS, these, starts, off, ahead, np.inf).readings[:, -1]
            errors.append(np.sqrt(np.mean((found - seen) ** 2, axis=0)))
    even, as_even, own_instants, even_instants = errors
    assert (as_even == even).all()
    assert (even_instants < 0.15 * own_instants).all()  # the mean of commands within a period leaves some


def test_states_between_the_instants_of_a_loop_are_those_of_an_even_acceleration():
    rng = np.random.default_rng(3)
    lateness = np.concatenate([[0.0], rng.uniform(-0.4, 0.4, 20)])
    instants = 0.02 * (np.arange(21) + lateness)
    loop = UnevenLoop(instants, lateness, np.zeros(20), np.zeros((21, 4)), np.zeros(21))

    def moving(t):
        """Tilt, wheel, their rates, and a torque that grows evenly."""
        states = np.zeros((len(t), 15))
        states[:, 0], states[:, 2] = 0.1 + 3.0 * t - 20.0 * t**2, 3.0 - 40.0 * t
        states[:, 1], states[:, 3], states[:, 4] = 5.0 * t**2, 10.0 * t, 0.3 * t
        return states

    found, expected = loop.even_states(moving(instants), 0.02), moving(0.02 * np.arange(21))
    assert found[:-1] == pytest.approx(expected[:-1], abs=1e-12)
