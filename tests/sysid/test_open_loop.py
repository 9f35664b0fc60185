"""Open-loop predictions are what the planar robot does."""

import numpy as np
import pytest

from twbal.core.start_pose import StartPose
from twbal.effects.library import effects_from
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_plant import PlanarPlant
from twbal.sysid.open_loop import predict_open_loop
from twbal.sysid.recording import Recording

EFFECTS = {
    "coulomb_friction": {"torque": 0.2},
    "actuation_delay": {"delay": 0.03},
    "motor_lag": {"time_constant": 0.02},
    "imu_delay": {"delay": 0.013},
    "tilt_filter": {"rate": 1.0, "lead": 0.01},
}
FINE, PERIODS = 40, 30  # physics steps of a control period


@pytest.fixture(scope="module")
def driven(paper):
    """A recording without noise, and the true state at each instant, as the predictor would tell it."""
    step = paper.control_period / FINE
    start = StartPose(0.05, 0.0, 0.0, 0.0)
    plant = PlanarPlant(robot=paper, effects=effects_from(EFFECTS), start=start, physics_step=step, seed=0)
    commands = np.random.default_rng(0).uniform(-3.0, 3.0, PERIODS)
    rows, states = [plant.reset(0)], []
    for instant, command in enumerate([*commands, 0.0]):
        states.append((*plant._state, plant._imu[instant * FINE % len(plant._imu), 2]))
        rows.append(plant.step(float(command)))
    seen = np.array(rows)[:-1, [1, 2, 4, 5]]
    sure = np.ones(PERIODS + 1, bool)
    recording = Recording("r", paper.control_period, commands, seen, np.zeros(PERIODS + 1), sure, np.ones(4, bool))
    return recording, np.array(states)


def predicted(paper, driven, starts, steps, off=None, limit=0.7):
    recording, states = driven
    off = np.zeros((len(starts), 8)) if off is None else off
    planar = planar_parameters(paper, EFFECTS)
    return predict_open_loop(planar, recording, FINE, states, np.array(starts), off, steps, limit)


def test_from_the_true_state_they_are_the_measurements_of_a_robot_without_noise(paper, driven):
    """But for what a late filter of the tilt forgot within the period before: states tell that at its ends alone."""
    starts, half_a_step = [4, 9, 17], 0.5 * paper.control_period / FINE  # by which the integrator's angles run ahead
    found = predicted(paper, driven, starts, 12).readings
    for k, start in enumerate(starts):
        true = driven[0].measured[start + 1 : start + 13]
        assert found[k, :, [1, 3]] == pytest.approx(true.T[[1, 3]], abs=1e-9)
        tilt, wheel = true.T[[0, 2]] - half_a_step * true.T[[1, 3]]
        assert found[k, :, 2] == pytest.approx(wheel, abs=1e-9)
        assert found[k, :, 0] == pytest.approx(tilt, abs=1e-4)


def test_a_start_that_is_off_is_so_at_once_and_ever_more_in_an_unstable_robot(paper, driven):
    off = np.zeros((1, 8))
    off[0, [0, 4, 6]] = 0.01  # of the tilt, now and before
    shift = (predicted(paper, driven, [6], 15, off).readings - predicted(paper, driven, [6], 15).readings)[0, :, 0]
    assert shift[0] == pytest.approx(0.01, rel=0.1)
    assert (np.diff(shift) > 0.0).all()


def test_a_body_that_comes_to_the_tilt_limit_lies_there(paper, driven):
    off = np.zeros((1, 8))
    off[0, [0, 4, 6]] = 0.3
    found = predicted(paper, driven, [6], 20, off, limit=0.4)
    fell = int(found.fell[0])
    assert 1 < fell < 20
    assert abs(found.readings[0, -1, 0]) > 0.35
    assert (found.readings[0, fell:] == found.readings[0, fell - 1]).all()
    assert predicted(paper, driven, [6], 3).fell[0] == 4


@pytest.mark.parametrize("late", [3.99, 5.3])
def test_an_imu_that_is_late_by_many_periods_shows_what_it_has_seen_that_long_ago(paper, late):
    effects, step = {"imu_delay": {"delay": late * paper.control_period}}, paper.control_period / FINE
    start = StartPose(0.05, 0.0, 0.0, 0.0)
    plant = PlanarPlant(robot=paper, effects=effects_from(effects), start=start, physics_step=step, seed=0)
    commands = np.random.default_rng(0).uniform(-3.0, 3.0, PERIODS)
    rows, states = [plant.reset(0)], []
    for command in [*commands, 0.0]:
        states.append((*plant._state, 0.0))
        rows.append(plant.step(float(command)))
    seen, sure = np.array(rows)[:-1, [1, 2, 4, 5]], np.ones(PERIODS + 1, bool)
    recording = Recording("r", paper.control_period, commands, seen, np.zeros(PERIODS + 1), sure, np.ones(4, bool))
    planar, starts = planar_parameters(paper, effects), np.array([4, 6, 15])
    found = predict_open_loop(planar, recording, FINE, np.array(states), starts, np.zeros((3, 8)), 10, 9.0).readings
    for k, begin in enumerate(starts):
        true = seen[begin + 1 : begin + 11]
        early = int(np.ceil(late))  # what is seen of the time before the start lies between states a period apart
        assert found[k, early:, 1] == pytest.approx(true[early:, 1], abs=1e-9)
        assert found[k, :, 1] == pytest.approx(true[:, 1], abs=0.05 * np.ptp(seen[:, 1]))
        assert found[k, early:, 0] == pytest.approx(true[early:, 0] - 0.5 * step * true[early:, 1], abs=1e-9)
