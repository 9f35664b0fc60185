"""A tilt that a log lacks, worked out of its gyro and accelerometer."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from twbal.core.robot_parameters import GRAVITY
from twbal.io.importers.tilt_by_gyro import FILTER_TIME, tilt_by_gyro

PERIOD = 0.01
TIMES = PERIOD * np.arange(1500)


def tilt(time):
    return 0.1 * np.sin(2.0 * time) + 0.05 * np.sin(5.0 * time + 1.0) + 0.03


def rate(time):
    return 0.2 * np.cos(2.0 * time) + 0.25 * np.cos(5.0 * time + 1.0)


def speeding_up(time):
    return 1.5 * np.sin(1.3 * time)  # m/s², of the axle


def test_the_sum_of_a_biased_gyro_is_the_tilt_but_for_its_mean_and_trend():
    found = tilt_by_gyro({"tilt_rate": rate(TIMES) + 0.05}, PERIOD)
    expected = tilt(TIMES) - np.polyval(np.polyfit(TIMES, tilt(TIMES), 1), TIMES)
    assert found == pytest.approx(expected, abs=1e-3)
    assert abs(found.mean()) < 1e-12


def test_the_mean_and_trend_are_those_of_the_samples_that_count():
    carried = rate(TIMES) + 3.0 * (TIMES < 2.0)
    found = tilt_by_gyro({"tilt_rate": carried}, PERIOD, 200)[200:]
    expected = tilt(TIMES[200:]) - np.polyval(np.polyfit(TIMES[200:], tilt(TIMES[200:]), 1), TIMES[200:])
    assert found == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize(("rows", "first"), [(1, 0), (1, 1), (5, 4)])
def test_too_few_samples_for_a_trend_have_a_tilt_of_0(rows, first):
    assert tilt_by_gyro({"tilt_rate": np.ones(rows)}, PERIOD, first).tolist() == [0.0] * rows


def test_one_sample_has_the_tilt_of_its_accelerometer():
    lean = np.array([0.1])
    signals = {"tilt_rate": lean, "accelerometer_forward": -np.sin(lean), "accelerometer_up": np.cos(lean)}
    assert tilt_by_gyro(signals, PERIOD) == pytest.approx(lean)


def test_a_filter_of_gyro_and_accelerometer_is_its_differential_equation():
    """It takes speeding up for leaning, and a bias of the gyro for a tilt: what the effect `tilt_filter` says."""
    lean, a = tilt(TIMES), speeding_up(TIMES)
    forward = a * np.cos(lean) - GRAVITY * np.sin(lean)
    up = a * np.sin(lean) + GRAVITY * np.cos(lean)
    signals = {"tilt_rate": rate(TIMES) + 0.02, "accelerometer_forward": forward, "accelerometer_up": up}
    found = tilt_by_gyro(signals, PERIOD)

    def wrong(time, off):
        return 0.02 - (np.arctan(speeding_up(time) / GRAVITY) + off) / FILTER_TIME

    off = solve_ivp(wrong, (0.0, TIMES[-1]), [found[0] - lean[0]], t_eval=TIMES, rtol=1e-8, atol=1e-9).y[0]
    assert np.abs(off).max() > 0.05
    assert found == pytest.approx(lean + off, abs=2e-3)


def test_an_accelerometer_in_any_unit_tells_the_same():
    lean = tilt(TIMES)
    signals = {"tilt_rate": rate(TIMES), "accelerometer_forward": -np.sin(lean), "accelerometer_up": np.cos(lean)}
    found = tilt_by_gyro(signals, PERIOD)
    assert found[500:] == pytest.approx(lean[500:], abs=2e-3)
