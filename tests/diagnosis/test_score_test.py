"""The score test of waves: means over control periods against quadrature of the functions themselves."""

from types import SimpleNamespace

import numpy as np
import pytest

from twbal.diagnosis import score_test
from twbal.diagnosis.score_test import _over_angle, _over_periods, _Waves, _within_periods


def test_waves_are_averaged_over_control_periods_and_both_wheels():
    """By 200 instants of a period and each wheel's own angle, for as many counts as a search tries together."""
    rng = np.random.default_rng(0)
    angles = np.cumsum(rng.uniform(-0.05, 0.1, 40))
    ahead = np.repeat(rng.uniform(-0.5, 0.5), 40)
    counts = np.arange(2.0, 6.0, 0.25)
    found = _over_periods(counts, _within_periods(angles), ahead).reshape(39, len(counts), 2)
    shares = (np.arange(200) + 0.5) / 200
    between = angles[:-1, None] + shares * np.diff(angles)[:, None]
    for number, count in enumerate(counts):
        for part, wave in enumerate((np.sin, np.cos)):
            wheels = [wave(count * (between + sign * ahead[0])).mean(axis=1) for sign in (-1.0, 1.0)]
            np.testing.assert_allclose(found[:, number, part], np.mean(wheels, axis=0), atol=0.002)


def test_a_single_wave_needs_no_next_one():
    angles = np.linspace(0.0, 3.0, 11)
    found = _over_periods(np.ones(1), _within_periods(angles), np.zeros(11))
    assert found.shape == (10, 2)
    np.testing.assert_allclose(found[:, 0], np.sin(0.5 * (angles[1:] + angles[:-1])), atol=0.005)


@pytest.mark.parametrize("grown", [np.inf, np.nan, 1e200])
def test_errors_that_grow_without_end_tell_of_no_wave(grown, monkeypatch):
    """A filter that does not hold them may be that of a fit which nothing else speaks against."""
    monkeypatch.setattr(score_test, "_answers", lambda *arguments: np.full((4, 8), grown))
    data = SimpleNamespace(recordings=[None])
    waves = _Waves(0, [np.zeros(3)], [np.zeros(3)])
    fit = SimpleNamespace(white=np.ones(8), kalman=None)
    with np.errstate(over="ignore", invalid="ignore"):
        count, size = _over_angle(data, fit, SimpleNamespace(B=np.zeros((2, 2))), waves, np.array([3.0, 4.0]))
    assert count == 3.0
    assert size == 0.0
