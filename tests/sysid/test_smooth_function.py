"""A smooth function in weight space has the kernel that it stands for."""

import numpy as np
import pytest

from twbal.sysid.smooth_function import _LENGTHS, smooth_over


def covariance(functions, spectrum, at):
    raw = functions._replace(means=np.zeros(1)).at(at)
    return (raw * spectrum) @ raw.T


@pytest.mark.parametrize("place", range(7))
def test_on_an_interval_the_prior_is_a_squared_exponential_within_the_data(place):
    functions = smooth_over(np.linspace(3.0, 7.0, 50), is_periodic=False)
    at = np.linspace(4.0, 6.0, 9)
    gaps = (at[:, None] - at) / 2.0
    kernel = np.exp(-0.5 * (gaps / _LENGTHS[place]) ** 2)
    np.testing.assert_allclose(covariance(functions, functions.spectra[place], at), kernel, atol=0.02)


def test_on_a_circle_the_prior_depends_on_the_angle_between_alone_and_comes_round():
    functions = smooth_over(np.linspace(0.0, 6.28, 50), is_periodic=True)
    at = np.linspace(0.0, 2.0 * np.pi, 13)
    for spectrum in functions.spectra:
        found = covariance(functions, spectrum, at)
        np.testing.assert_allclose(np.diag(found), 1.0)
        np.testing.assert_allclose(found[0], found[-1], atol=1e-9)
        np.testing.assert_allclose(found[3, 5], found[6, 8])


def test_functions_have_no_mean_over_the_data():
    values = np.random.default_rng(0).gamma(2.0, size=300)
    functions = smooth_over(values, is_periodic=False)
    np.testing.assert_allclose(functions.at(values).mean(axis=0), 0.0, atol=1e-12)
