"""Rollouts in PyBullet from motions whose angles and rates are of one instant: truth by an integrator of high order."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from synthetic_recordings import NOISE, synthetic_recording

from twbal.core.robot_parameters import GRAVITY
from twbal.core.start_pose import InitialState
from twbal.diagnosis.engine_rollouts import replayed
from twbal.diagnosis.filter_result import filter_recordings
from twbal.diagnosis.gap import Models, measure_gaps
from twbal.diagnosis.inputs import DiagnosedSimulation
from twbal.diagnosis.rollouts_from_recordings import RolloutStarts
from twbal.sim.replay import ReplayStart, replay
from twbal.sim.restart_state import RestartState
from twbal.sysid.noise import NoiseModel
from twbal.sysid.recording import MEASURED

STEP, SUBSTEPS = 0.001, 10
LEVELS = np.array([NOISE[name] for name in MEASURED])
FALLING = InitialState(0.05, -3.0, 0.4)  # tilts back fast, as a small robot does that is pushed


def falling(robot, seconds):
    """(4,) tilt, wheel angle in space and their rates without torque, from `FALLING`, by Lagrange's equations."""
    m, h, r = robot.body_mass, robot.com_height, robot.wheel_radius
    wheels = 2.0 * (robot.wheel_mass * r**2 + robot.wheel_inertia) + m * r**2
    body = robot.body_inertia_pitch + m * h**2

    def change(time, y):
        tilt, _, rate, speed = y
        coupled = m * r * h * np.cos(tilt)
        right = [m * r * h * np.sin(tilt) * rate**2, m * GRAVITY * h * np.sin(tilt)]
        return [rate, speed, *np.linalg.solve([[coupled, wheels], [body, coupled]], right)]

    begin = [FALLING.tilt, 0.0, FALLING.tilt_rate, FALLING.speed / r]
    return solve_ivp(change, (0.0, seconds), begin, rtol=1e-10, atol=1e-12).y[:, -1]


@pytest.fixture(scope="module")
def made(paper):
    """A recording, and what the right model makes of it."""
    kept = (synthetic_recording(paper, {}, seed=3, periods=400, tolerance=0.0),)
    return kept, filter_recordings(paper, {}, NoiseModel(LEVELS, np.array([0.01, 0.01])), 0.0, kept, SUBSTEPS)


def test_angles_are_those_of_the_instants_of_the_rates(paper, made):
    """The engine's own run ahead by half of a step: so its body starts 1.5 mrad behind, and falls another way."""
    periods = 8
    true = falling(paper, periods * paper.control_period)
    start = ReplayStart(FALLING, RestartState(-FALLING.tilt), np.zeros(0), np.zeros((0, 3)))  # wheels at 0 in space
    simulation = DiagnosedSimulation(paper, {}, STEP)
    held = np.zeros((1, periods))
    found = replayed(simulation, made[1], [start], held)[0, -1]
    plain = replay(paper, [], STEP, [start], held)[0, -1]
    off, off_plain = (abs(seen[2] - true[2]) for seen in (found, plain))
    assert off < 2e-3
    assert off_plain > 5.0 * off
    assert found[[1, 4]] == pytest.approx([true[0], true[1] - true[0]], abs=2e-4)


def test_angles_that_the_fit_has_run_ahead_of_rates_do_so_in_rollouts(paper, made):
    lead = 0.002
    start = ReplayStart(FALLING, RestartState(0.0), np.zeros(0), np.zeros((0, 3)))
    simulation = DiagnosedSimulation(paper, {}, STEP)
    prompt, ahead = (
        replayed(simulation, replace(made[1], angle_lead=each), [start], np.zeros((1, 3)))[0] for each in (0.0, lead)
    )
    np.testing.assert_allclose(ahead[:, 1] - prompt[:, 1], lead * prompt[:, 2], atol=1e-12)
    np.testing.assert_allclose(ahead[:, 4] - prompt[:, 4], lead * prompt[:, 5], atol=1e-12)


def test_rollouts_begin_when_the_filter_has_settled_or_a_quarter_of_a_short_recording_is_over(made, paper):
    kept, seen = made
    begun = []

    def resting(result, starts, commands):
        begun.append([len(start.past_commands) for start in starts])
        return np.zeros((len(starts), commands.shape[1] + 1, 7))

    for settling, first in ((50, 50), (10_000, 100), (0, 5)):
        begun.clear()
        stretches = RolloutStarts(settling, 5, 40, 3)
        measure_gaps(Models(seen, seen, seen), kept, resting, [3], stretches, LEVELS, paper.wheel_radius)
        assert min(begun[0]) == first
