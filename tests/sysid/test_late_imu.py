"""A predictor that corrects nothing shows what the planar robot shows, however late the IMU is."""

from dataclasses import replace

import numpy as np
import pytest

from twbal.core.start_pose import StartPose
from twbal.effects.imu_delay import ImuDelay
from twbal.effects.library import values_of
from twbal.effects.tilt_filter import TiltFilter
from twbal.planar.actuation import EVEN
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_plant import PlanarPlant
from twbal.sysid.kalman_predictor import STATE_COLUMNS, run_predictor

PERIODS, SUBSTEPS = 25, 10


def errors_of(robot, effects, measured, commands, instants=EVEN):
    errors, states = np.empty((PERIODS + 1, 4)), np.empty((PERIODS + 1, STATE_COLUMNS))
    gains, pushes = np.zeros((1, 8, 4)), np.zeros((2, 4))
    planar, yaw_rates = planar_parameters(robot, values_of(effects)), np.zeros(PERIODS + 1)
    run_predictor(
        planar, commands, measured, yaw_rates, robot.control_period, instants, SUBSTEPS, 0.0, gains, pushes,
        np.zeros(0), 0.0, errors, states,
    )  # fmt: skip
    return errors


def shown(robot, effects, commands):
    step, start = robot.control_period / SUBSTEPS, StartPose(0.0, 0.0, 0.0, 0.0)
    with PlanarPlant(robot=robot, effects=effects, start=start, physics_step=step, seed=0) as plant:
        return np.array([plant.reset(0), *(plant.step(u) for u in commands)])[:, [1, 2, 4, 5]]


@pytest.mark.parametrize("late", [0.0, 1.3, 2.97, 3.5, 3.97, 4.0, 5.2, 9.9])
@pytest.mark.parametrize("beside", [[], [TiltFilter(3.0, 0.02)]], ids=["alone", "with a filter of the tilt"])
def test_what_a_late_imu_shows_is_predicted(paper, late, beside):
    effects = [ImuDelay(late * paper.control_period), *beside]
    commands = 2.0 * np.sin(0.9 * np.arange(PERIODS))
    measured = shown(paper, effects, commands)
    assert np.abs(errors_of(paper, effects, measured, commands)).max() < 1e-9


@pytest.mark.parametrize("late", [2.5, 3.97, 6.5])
def test_it_is_predicted_in_a_loop_of_long_and_short_periods_too(paper, late):
    """Truth: the same robot in an even loop of half the period, and the same commands at the same times."""
    effects, steps = [ImuDelay(late * paper.control_period)], np.tile([1, 3], PERIODS)[:PERIODS]
    commands = 2.0 * np.sin(0.9 * np.arange(PERIODS))
    numbers, period = np.concatenate([[0], np.cumsum(steps)]), paper.control_period
    fine = shown_by_halves(paper, effects, np.repeat(commands, steps))
    errors = errors_of(paper, effects, fine[numbers], commands, 0.5 * period * numbers)
    assert (np.abs(errors).max(axis=0) < 0.03 * np.ptp(fine, axis=0)).all()


def shown_by_halves(robot, effects, commands):
    """What the robot shows twice in a control period [s]."""
    return shown(replace(robot, control_period=0.5 * robot.control_period), effects, commands)
