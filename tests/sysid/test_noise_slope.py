"""The slope by the levels of noise is that of finite differences."""

import numpy as np
import pytest
from scipy.optimize import approx_fprime
from synthetic_recordings import synthetic_recording

from twbal.planar.parameters import planar_parameters
from twbal.sysid.kalman import kalman_filter, solution
from twbal.sysid.likelihood import cost
from twbal.sysid.model import Data, Model
from twbal.sysid.noise import UNSENSED, NoiseModel
from twbal.sysid.noise_fit import _Objective, refilter
from twbal.sysid.noise_slope import of_one_level_each, slope_of_levels

SENSORS, TORQUES = np.array([0.004, 0.02, 0.002, 0.05]), np.array([0.05, 0.08])
LASTING = np.array([0.05, 0.1, 0.002, 0.01, 0.003, 0.01])
EFFECTS = {
    "tilt": {},
    "filtered tilt": {"tilt_filter": {"rate": 1.5, "lead": 0.0}},
    "late IMU": {"imu_delay": {"delay": 0.027}},
}
STEP = 1e-4


@pytest.mark.parametrize("unsensed", [None, 1, 3])
@pytest.mark.parametrize("effects", EFFECTS.values(), ids=EFFECTS)
def test_the_slope_is_that_of_central_differences(paper, effects, unsensed, monkeypatch):
    """Where no gains are taken for settled: the instant from which they are may jump between two levels."""
    monkeypatch.setattr("twbal.sysid.kalman._SETTLED", 0.0)
    recordings = [synthetic_recording(paper, effects, seed=seed, periods=300, tolerance=0.0) for seed in (3, 4)]
    recordings[1].usable[100:110] = False
    sensors = SENSORS.copy()
    if unsensed is not None:
        sensors[unsensed] = UNSENSED
    data = Data(recordings, 10)
    model = Model(planar_parameters(paper, effects), 0.0, NoiseModel(sensors, TORQUES, LASTING))
    before, linear = data.filter(model), data.linear(model)
    errors = data.errors(model, before)
    if unsensed is not None:
        for each in errors:
            each[:, unsensed] = 0.0

    def moved(kalman):
        return [refilter(linear.F, linear.C, before.gains, kalman.gains, each) for each in errors]

    def value(logs):
        levels = np.exp(logs)
        kalman = kalman_filter(linear, NoiseModel(levels[:4], levels[4:6], levels[6:]))
        return cost(moved(kalman), data.usable, kalman)

    logs = np.log(np.concatenate([0.7 * sensors, 1.5 * TORQUES, 2.0 * LASTING]))
    here = NoiseModel(0.7 * sensors, 1.5 * TORQUES, 2.0 * LASTING)
    kalman = kalman_filter(linear, here)
    slope = slope_of_levels(
        linear, of_one_level_each(linear), here, solution(linear, here), moved(kalman), data.usable, kalman.measured
    )
    central = 0.5 * (approx_fprime(logs, value, STEP) + approx_fprime(logs, value, -STEP))
    np.testing.assert_allclose(slope, central, rtol=1e-4, atol=1e-6 * np.abs(central).max())


def test_the_search_for_the_noise_has_the_slope_of_what_it_minimises(paper):
    """The prior of a discrepancy's levels among it, and gains that settle."""
    recording = synthetic_recording(paper, {}, seed=3, periods=300, tolerance=0.0)
    data = Data([recording], 10)
    model = Model(planar_parameters(paper, {}), 0.0, NoiseModel(SENSORS, TORQUES, LASTING))
    kalman = data.filter(model)
    largest = NoiseModel(np.full(4, 1.0), np.full(2, 1.0), 3.0 * LASTING)
    objective = _Objective(data.linear(model), kalman.gains, data.errors(model, kalman), data.usable, largest)
    x = np.log(np.concatenate([SENSORS, 1.2 * TORQUES, 0.8 * LASTING]))
    value, slope = objective.with_slope(x)
    assert value == objective.value(x)
    central = 0.5 * (approx_fprime(x, objective.value, STEP) + approx_fprime(x, objective.value, -STEP))
    np.testing.assert_allclose(slope, central, rtol=1e-2, atol=1e-3 * np.abs(central).max())
