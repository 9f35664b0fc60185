"""Smoothed derivatives against closed forms."""

import numpy as np
import pytest

from twbal.core.smoothed_derivatives import smoothed

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
