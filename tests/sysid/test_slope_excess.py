"""Squared slopes of weighted errors against the curvature of their likelihood, by draws of normal errors."""

from types import SimpleNamespace

import numpy as np
import pytest

from twbal.sysid.intervals import standard_errors
from twbal.sysid.likelihood import whiten
from twbal.sysid.model import FreeParameter
from twbal.sysid.slope_excess import slope_excess


@pytest.mark.parametrize("channels", [1, 4])
def test_squared_slopes_exceed_the_gain_by_what_normal_errors_show(channels):
    """Of a small shift of 100,000 normal errors that were drawn, by the likelihood itself."""
    rng, shift = np.random.default_rng(5), 0.02
    errors = np.zeros((100_001, 4))
    errors[:, :channels] = rng.normal(size=(100_001, channels))
    moved, back = errors.copy(), errors.copy()
    moved[:, 0] += shift
    back[:, 0] -= shift
    whiteners, usable = np.eye(4)[None], np.ones(len(errors), bool)
    white, after, before = (whiten(each, usable, whiteners, channels) for each in (errors, moved, back))
    gain = 0.5 * float((after**2).sum() + (before**2).sum()) - float((white**2).sum())
    assert slope_excess(channels) == pytest.approx(float(((after - white) ** 2).sum()) / gain, rel=0.02)


def test_standard_errors_are_how_fits_to_other_noise_scatter():
    """Of a linear model of four channels and its Gauss-Newton fits, each to other normal noise."""
    rng, instants, fits, nudge = np.random.default_rng(7), 300, 250, 1e-6
    inputs, whiteners, usable = rng.normal(size=(instants + 1, 4, 2)), np.eye(4)[None], np.ones(instants + 1, bool)
    free = tuple(FreeParameter(name, -1e3, 1e3, 0.0, np.inf, nudge) for name in ("first", "second"))
    values, errors = [], []
    for _ in range(fits):
        noise, x = rng.normal(size=(instants + 1, 4)), np.zeros(2)

        def white(at, noise=noise):
            return whiten(noise - inputs @ at, usable, whiteners, 4).ravel()

        for _ in range(6):
            J = np.column_stack([(white(x + nudge * unit) - white(x)) / nudge for unit in np.eye(2)])
            x = x - np.linalg.solve(J.T @ J, J.T @ white(x))
        fit = SimpleNamespace(free_parameters=free, white=white(x))
        values.append(x)
        errors.append([standard_errors(fit, J, 60, 1.0, excess) for excess in (1.0, slope_excess(4))])
    scatter = np.std(values, axis=0)
    short, right = np.sqrt(np.mean(np.square(errors), axis=0)) / scatter
    assert (short < 0.95).all()  # what products of slopes make of it
    np.testing.assert_allclose(right, 1.0, atol=0.12)
