"""The model discrepancy: what is missing is followed, and errors are white where a model of it is there."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_recordings import NOISE as SENSED
from synthetic_recordings import synthetic_recording

from twbal.planar.parameters import planar_parameters
from twbal.sysid.model import Data, Model
from twbal.sysid.noise import BIAS_TIME, LASTING, UNSENSED, NoiseModel
from twbal.sysid.noise_fit import louder_sensors, refilter, summed_gyro_noise

SENSORS, TORQUES = np.array([0.004, 0.02, 0.002, 0.05]), np.array([0.05, 0.08])
BIAS = 5
FILTER = {"tilt_filter": {"rate": 1.5, "lead": 0.0}}


def biased(recording, walk, rate, seed):
    """The recording of a gyro whose bias walks; a filter of the tilt adds it up, forgetting at a rate."""
    rng = np.random.default_rng(seed)
    bias = np.cumsum(walk * np.sqrt(recording.period) * rng.standard_normal(len(recording) + 1))
    return off_by(recording, bias, rate)


def off_by(recording, gyro, rate):
    """The recording of a gyro whose readings (T + 1,) are off; a filter of the tilt adds that up, if at a rate."""
    period, tilt = recording.period, np.zeros_like(gyro)
    for n in range(1, len(tilt)):
        tilt[n] = np.exp(-rate * period) * tilt[n - 1] + period * gyro[n - 1]
    off = np.column_stack([tilt if rate else 0.0 * tilt, gyro, 0.0 * gyro, 0.0 * gyro])
    return replace(recording, measured=recording.measured + off)


@pytest.mark.parametrize("effects", [{}, FILTER], ids=["tilt", "filtered tilt"])
@pytest.mark.parametrize("component", range(LASTING))
def test_the_predictor_follows_a_discrepancy_as_the_linear_model_says(paper, component, effects):
    levels = np.zeros(LASTING)
    levels[component] = [1.0, 1.0, 0.01, 0.05, 0.01, 0.05][component]
    recording = synthetic_recording(paper, effects, seed=3, periods=300, tolerance=0.0)
    data = Data([recording], 10)
    model = Model(planar_parameters(paper, effects), 0.0, NoiseModel(SENSORS, TORQUES, 1e-6 * levels))
    other = model._replace(noise=model.noise._replace(discrepancy=levels))
    before, after, linear = data.filter(model), data.filter(other), data.linear(model)
    errors, truth = data.errors(model, before)[0], data.errors(other, after)[0]
    moved = refilter(linear.F, linear.C, before.gains, after.gains, errors)
    assert np.abs(truth - errors).max() > 1e-3
    assert np.abs(moved - truth).max() < 0.05 * np.abs(truth - errors).max()


@pytest.mark.parametrize("effects", [{}, FILTER], ids=["tilt", "filtered tilt"])
def test_a_gyro_whose_bias_walks_is_followed(paper, effects):
    """Its errors are white with the component of the bias, and far from it without."""
    rate = effects.get("tilt_filter", {}).get("rate", 0.0)
    recordings = [
        biased(synthetic_recording(paper, effects, seed=seed, periods=1000, tolerance=0.0), 0.01, rate, seed)
        for seed in (1, 2)
    ]
    largest = np.full(LASTING, 1e-9)
    planar = planar_parameters(paper, effects)
    left = []
    for most in (1e-9, 1.0):
        largest[BIAS] = most
        data = Data(recordings, 10, NoiseModel(np.full(4, np.inf), np.full(2, np.inf), largest.copy()))
        model = Model(planar, 0.0, NoiseModel(SENSORS, TORQUES, 0.1 * largest))
        for _ in range(3):
            model = data.with_noise(model, 30)
        kalman = data.filter(model)
        left.append(data.autocorrelation(data.errors(model, kalman), kalman))
    assert left[0][1] > 10.0
    assert left[1][:2].max() < 2.0
    assert model.noise.discrepancy[BIAS] == pytest.approx(0.01 * np.sqrt(BIAS_TIME / 2.0), rel=0.4)


def test_errors_that_swing_back_tell_of_a_sensor_that_was_taken_for_silent():
    """White noise of 0.02 rad/s that a filter follows: each error has the noise of two instants, less the second."""
    rng = np.random.default_rng(2)
    noise = 0.02 * rng.standard_normal((5001, 4))
    followed = np.diff(noise, axis=0)
    usable = np.ones(5000, bool)
    silent = NoiseModel(np.array([0.02, 1e-4, 0.02, UNSENSED]), TORQUES)
    found = louder_sensors(silent, [followed], [usable])
    assert found.sensors[1] == pytest.approx(0.02, rel=0.05)
    np.testing.assert_array_equal(found.sensors[[0, 2, 3]], silent.sensors[[0, 2, 3]])
    assert (found.torques < silent.torques).all()
    assert louder_sensors(silent, [noise], [usable[:1].repeat(5001)]) is None  # these are white


def test_the_noise_of_a_gyro_is_found_though_loud_torques_stood_for_it(paper):
    """At 200 Hz, with a filtered tilt: the likelihood has an optimum with a silent gyro, in which a search stayed."""
    fast = replace(paper, control_period=0.005)
    recording = synthetic_recording(fast, FILTER, seed=4, periods=1500, tolerance=0.0)
    data, planar = Data([recording], 4), planar_parameters(fast, FILTER)
    misled = NoiseModel(np.array([0.002, 3e-4, 0.002, 0.05]), np.array([4.0, 4.0]), np.full(LASTING, 1e-4))
    model = Model(planar, 0.0, misled)
    for _ in range(4):
        model = data.with_noise(model, 30)
    assert model.noise.sensors[1] == pytest.approx(SENSED["tilt_rate"], rel=0.15)
    assert (data.autocorrelation(data.errors(model, data.filter(model)), data.filter(model)) < 2.0).all()


def test_noise_of_a_gyro_that_the_tilt_has_added_up_is_found_though_other_noise_stood_for_it(paper):
    """Both do the same to the gyro's reading: a search that began with the one kind stayed there."""
    recordings = []
    for seed in (6, 7):
        clean = synthetic_recording(paper, FILTER, seed=seed, periods=1500, tolerance=0.0)
        noise = 0.06 * np.random.default_rng(seed).standard_normal(len(clean) + 1)
        recordings.append(off_by(clean, noise, FILTER["tilt_filter"]["rate"]))
    data, planar = Data(recordings, 10), planar_parameters(paper, FILTER)
    misled = NoiseModel(np.array([0.003, 0.06, 0.001, 0.05]), np.array([0.02, 0.02]), np.full(LASTING, 1e-6))
    model = Model(planar, 0.0, misled)
    for _ in range(3):
        model = data.with_noise(model, 30)
    assert model.noise.discrepancy[3] == pytest.approx(0.06, rel=0.1)
    together = np.hypot(model.noise.discrepancy[3], model.noise.sensors[1])
    assert together == pytest.approx(np.hypot(0.06, SENSED["tilt_rate"]), rel=0.05)


def test_where_no_filter_adds_up_the_gyro_its_noise_is_its_own():
    levels = np.array([0.01, 0.01, 0.001, 1e-6, 0.001, 0.001])
    noise = NoiseModel(SENSORS, TORQUES, levels)
    assert summed_gyro_noise(noise, 0.0) is None
    assert summed_gyro_noise(noise._replace(discrepancy=np.zeros(LASTING)), 0.02) is None
    found = summed_gyro_noise(noise, 0.02)
    assert found.discrepancy[3] == SENSORS[1]
    assert found.sensors[1] < SENSORS[1]
    assert summed_gyro_noise(found, 0.02) is None
