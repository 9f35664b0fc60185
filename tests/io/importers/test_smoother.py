"""The smoother against signals whose rates are known, and its own account of its error against the error."""

import numpy as np
import pytest

from twbal.io.importers.smoother import smooth

PERIOD = 0.015
T = PERIOD * np.arange(1200)
SHAPES = {
    "slow": (0.05 * np.sin(2 * T), 0.1 * np.cos(2 * T)),
    "swinging": (0.1 * np.sin(9 * T) + 0.02 * np.sin(20 * T), 0.9 * np.cos(9 * T) + 0.4 * np.cos(20 * T)),
    "wandering": (np.sin(0.7 * T) * T, 0.7 * np.cos(0.7 * T) * T + np.sin(0.7 * T)),
}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("noise", [1e-4, 2e-3])
def test_rates_are_closer_than_differences_and_as_close_as_they_say(shape, noise):
    value, rate = SHAPES[shape]
    measured = value + noise * np.random.default_rng(1).standard_normal(len(T))
    found = smooth(measured, PERIOD)
    inner = slice(20, -20)
    error = np.sqrt(np.mean((found.rate - rate)[inner] ** 2))
    naive = np.sqrt(np.mean((np.gradient(measured, PERIOD) - rate)[inner] ** 2))
    assert error < 0.8 * naive
    assert 0.3 < error / found.rate_sd < 3.0
    assert found.noise_sd == pytest.approx(noise, rel=0.25)


def test_an_encoders_steps_do_not_show_in_the_rate():
    value, rate = SHAPES["wandering"]
    step = 0.05
    found = smooth(step * np.round(value / step), PERIOD)
    naive = np.gradient(step * np.round(value / step), PERIOD)
    assert np.std(found.rate - rate) < 0.3 * np.std(naive - rate)


def test_a_channel_that_never_moves_has_no_rate():
    assert smooth(np.full(100, 3.0), PERIOD).rate == pytest.approx(0.0, abs=1e-9)
