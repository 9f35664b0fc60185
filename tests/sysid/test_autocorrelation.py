"""The Ljung-Box statistic over its expectation, beside its definition and its distribution for white errors."""

import numpy as np
import pytest

from twbal.sysid.autocorrelation import ljung_box_ratio

LAGS = 20


def by_definition(errors):
    """Of one channel of one recording, n (n + 2) Σ ρ_k² / (n - k) over the number of lags."""
    n, power = len(errors), errors @ errors
    rho = [errors[k:] @ errors[:-k] / power for k in range(1, LAGS + 1)]
    return n * (n + 2) * sum(r**2 / (n - k) for k, r in enumerate(rho, 1)) / LAGS


def coloured(rng, count, memory):
    """Errors (count, 4) of which each remembers a share of the one before."""
    errors = rng.standard_normal((count, 4))
    for n in range(1, count):
        errors[n] += memory * errors[n - 1]
    return errors


@pytest.mark.parametrize("memory", [0.0, 0.4, -0.3])
def test_it_is_the_statistic_by_its_definition(memory):
    errors = coloured(np.random.default_rng(1), 400, memory)
    found = ljung_box_ratio([errors], np.zeros(4), 400, LAGS)
    np.testing.assert_allclose(found, [by_definition(column) for column in errors.T])


def test_its_mean_over_white_errors_is_one_also_of_several_recordings():
    rng, found = np.random.default_rng(2), []
    for _ in range(150):
        parts = [rng.standard_normal((count, 4)) for count in (500, 300, 200)]
        found.append(ljung_box_ratio(parts, np.zeros(4), 1000, LAGS))
    mean, error = np.mean(found), np.std(found) / np.sqrt(600)
    assert abs(mean - 1.0) < 4.0 * error + 2 * LAGS / 1000  # pairs across the ends of recordings are missing
    assert np.std(found) == pytest.approx(np.sqrt(2.0 / LAGS), rel=0.15)  # of χ² of so many degrees, over that number


def test_errors_far_below_their_noise_count_the_less_and_a_channel_without_errors_is_white():
    errors = coloured(np.random.default_rng(3), 1000, 0.5)
    errors[:, 1] = 0.0
    variances = np.array([0.0, 1.0, 4.0, 4.0]) * np.mean(errors**2, axis=0).max()
    found = ljung_box_ratio([errors], variances, 1000, LAGS)
    alone = ljung_box_ratio([errors], np.zeros(4), 1000, LAGS)
    assert found[1] == 1.0
    shares = np.mean(errors**2, axis=0)[2:] / variances[2:]
    np.testing.assert_allclose(found[2:], shares**2 * alone[2:])
    assert found[0] == alone[0] > 5.0
