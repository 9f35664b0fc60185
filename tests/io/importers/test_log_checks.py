"""Parts of the checks of logs against closed forms: kernels, intervals, repeated rows, scales of single columns."""

import numpy as np
import pytest

from twbal.core.errors import ConfigError
from twbal.io.importers.checks.block_regression import regression
from twbal.io.importers.checks.repeated_rows import longest_repeat
from twbal.io.importers.checks.smoothing import smoothed
from twbal.io.importers.columns import Columns
from twbal.io.importers.mapping import mapping

PERIOD = 0.01
T = PERIOD * np.arange(2000)


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_smoothed_derivatives_of_a_cubic_are_its_own_about_the_middle(order):
    cubic = np.polynomial.Polynomial([0.3, -0.2, 0.5, 0.1])
    found = smoothed(cubic(T), PERIOD, 0.3, order)
    middle = T[15:-15]
    # A kernel adds a constant to T², which is its second moment.
    moment = float(np.mean(smoothed(T**2, PERIOD, 0.3) - middle**2))
    derivative = cubic.deriv(order) if order else cubic
    expected = derivative(middle) + 0.5 * moment * derivative.deriv(2)(middle)
    assert found == pytest.approx(expected, rel=2e-3, abs=2e-3)


def test_a_signal_that_was_taken_later_is_put_back():
    late = 0.5 * PERIOD
    on_time, moved = smoothed(np.sin(3 * T), PERIOD, 0.2), smoothed(np.sin(3 * (T + late)), PERIOD, 0.2, 0, late)
    assert moved == pytest.approx(on_time, abs=1e-5)


def test_intervals_hold_for_coloured_residuals():
    """Slopes of 100 regressions with residuals and regressor of 0.1 s memory: none of them outside its interval."""
    rng = np.random.default_rng(0)
    outside = 0
    for _ in range(100):
        x, e = (np.convolve(rng.standard_normal(2020), np.exp(-np.arange(21) / 10), mode="valid") for _ in range(2))
        fit = regression(1.0 + 2.0 * x + e, [x], PERIOD)
        outside += abs(fit.coefficients[0] - 2.0) > fit.half_widths[0]
        assert fit.half_widths[0] < 1.0
    assert outside == 0


def test_a_block_that_comes_again_is_found_and_chance_is_not():
    rng = np.random.default_rng(1)
    tilt = np.round(np.cumsum(rng.standard_normal(1000)), 1)
    assert longest_repeat({"tilt": tilt}) is None
    assert longest_repeat({"tilt": np.zeros(1000)}) is None
    again = np.concatenate([tilt, tilt[300:500]])
    first, second, count = longest_repeat({"tilt": again})
    assert (first, second, count) == (300, 1000, 200)


@pytest.mark.parametrize(
    ("quantity", "unit", "plain"),
    [("tilt_rate", "dps", "deg/s"), ("command", "N m", "N·m"), ("command", "mN·m", "mNm"), ("command", "mN m", "mNm")],
)
def test_units_may_be_written_in_several_ways(quantity, unit, plain):
    def made(unit):
        told = {"time": {"from": 1}, "tilt": {"from": 2}, "wheel_angle": {"from": 3}, "command": {"from": 4}}
        told[quantity] = {"from": 5, "unit": unit}
        return mapping(told, [], None, None, False, False, 0.0, 3).quantities[quantity]

    assert made(unit) == made(plain)


def test_two_columns_may_have_a_scale_each():
    told = {"time": {"from": 1}, "tilt": {"from": 2}, "command": {"from": 3}}
    wheels = {"from": [4, 5], "scale": [1, -2]}
    made = mapping({**told, "wheel_angle": wheels}, [], None, None, False, False, 0.0, 3)
    values = np.array([[0.0, 0.1, 1.0, 3.0, -1.0]])
    signals = made.signals(Columns(values, np.array([1]), "row", ()))
    assert signals["wheel_angle"] == pytest.approx([2.5])
    assert (signals["left wheel_angle"][0], signals["right wheel_angle"][0]) == (3.0, 2.0)
    with pytest.raises(ConfigError, match="has 1 scales for 2 columns"):
        mapping({**told, "wheel_angle": {"from": [4, 5], "scale": [1]}}, [], None, None, False, False, 0.0, 3)
