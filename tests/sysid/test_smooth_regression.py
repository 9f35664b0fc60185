"""Evidence and posterior of a smooth function, against dense normal distributions and against draws."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from twbal.sysid.smooth_function import smooth_over
from twbal.sysid.smooth_regression import evidence, null_gains, posterior_weights, projected

COUNT = 120


def problem(rng, size=0.0, nuisance=0.0):
    """Functions of a variable, and one nuisance parameter that does nearly what a straight line does."""
    z = rng.uniform(-1.0, 1.0, COUNT)
    functions = smooth_over(z, is_periodic=False)
    A, J = functions.at(z), -(z + 0.1 * rng.normal(size=COUNT))[:, None]
    truth = size * np.sin(3.0 * z)
    y = truth - J[:, 0] * nuisance + rng.normal(size=COUNT)
    return z, functions, A, J, y


def test_the_gain_is_the_ratio_of_two_dense_normal_densities():
    _, functions, A, J, y = problem(np.random.default_rng(0), size=1.0, nuisance=0.5)
    precision = np.array([4.0])
    found = evidence(projected(A, y, J, precision), functions.spectra, 1.0)
    without = np.eye(COUNT) + J @ J.T / precision
    beside = without + (A * found.prior) @ A.T
    zero = np.zeros(COUNT)
    gain = multivariate_normal(zero, beside).logpdf(y) - multivariate_normal(zero, without).logpdf(y)
    assert found.gain == pytest.approx(gain, rel=1e-6)
    assert found.gain > 5.0


def test_the_posterior_is_that_of_the_joint_normal_distribution_of_weights_and_nuisance():
    _, functions, A, J, y = problem(np.random.default_rng(1), size=1.0)
    precision = np.array([4.0])
    found = projected(A, y, J, precision)
    prior = evidence(found, functions.spectra, 1.0).prior + 1e-9
    weights = posterior_weights(found, prior, 1.0)
    B = np.hstack([A, -J])
    covariance = np.linalg.inv(B.T @ B + np.diag(np.append(1.0 / prior, precision)))
    np.testing.assert_allclose(weights.covariance, covariance[:-1, :-1], atol=1e-6)
    np.testing.assert_allclose(weights.mean, (covariance @ B.T @ y)[:-1], atol=1e-5)
    np.testing.assert_allclose(found.moved + found.shift @ weights.mean, (covariance @ B.T @ y)[-1:], atol=1e-5)


def test_without_a_function_the_drawn_null_is_how_gains_are_distributed():
    rng = np.random.default_rng(2)
    _, functions, A, J, _ = problem(rng)
    precision = np.array([1e-6])
    gains = [
        evidence(projected(A, rng.normal(size=COUNT), J, precision), functions.spectra, 1.0).gain for _ in range(300)
    ]
    drawn = null_gains(projected(A, rng.normal(size=COUNT), J, precision), functions.spectra, 1.0, rng)
    for share in (0.5, 0.9, 0.95):
        assert np.mean(gains <= np.quantile(drawn, share)) == pytest.approx(share, abs=0.06)


def test_the_band_holds_the_truth_about_as_often_as_it_says():
    rng, inside = np.random.default_rng(3), []
    for _ in range(60):
        z, functions, A, J, y = problem(rng, size=1.5, nuisance=rng.normal())
        found = projected(A, y, J, np.array([1.0]))
        weights = posterior_weights(found, evidence(found, functions.spectra, 1.0).prior, 1.0)
        grid = np.linspace(-0.9, 0.9, 19)
        at = functions.at(grid)
        error = np.sqrt(np.einsum("im,mk,ik->i", at, weights.covariance, at))
        truth = 1.5 * (np.sin(3.0 * grid) - np.sin(3.0 * z).mean())
        inside.append(np.abs(at @ weights.mean - truth) < 1.96 * error)
    assert np.mean(inside) > 0.88


def test_dispersion_asks_for_more():
    _, functions, A, J, y = problem(np.random.default_rng(4), size=1.0)
    found = projected(A, y, J, np.array([1.0]))
    assert evidence(found, functions.spectra, 4.0).gain < 0.5 * evidence(found, functions.spectra, 1.0).gain
