"""Intervals of block bootstrap hold the truth as often as they say, also where samples are correlated."""

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import binom

from twbal.core.block_bootstrap import RESAMPLES, block_count, interval95, resampled_means


def correlated(rng, size, memory):
    """Normal samples of unit variance, whose correlation falls by `memory` from one to the next."""
    noise = rng.standard_normal(size + 200)
    return lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], noise)[200:]


@pytest.mark.parametrize("memory", [0.0, 0.6, 0.9])
def test_intervals_of_a_root_mean_square_hold_it_in_about_95_of_100_cases(memory):
    rng, size, length, repeats = np.random.default_rng(1), 600, 60, 300
    held = 0
    for _ in range(repeats):
        squares = correlated(rng, size, memory)[:, None] ** 2
        resampled = np.sqrt(resampled_means([squares], [length], rng)[:, 0])
        low, high = interval95(float(np.sqrt(squares.mean())), resampled, block_count([size], [length]))
        held += low < 1.0 < high
    assert binom.ppf(0.001, repeats, 0.93) <= held <= binom.ppf(0.999, repeats, 0.97)


def test_blocks_that_are_too_short_for_the_correlation_would_not():
    rng, repeats, held = np.random.default_rng(2), 200, 0
    for _ in range(repeats):
        squares = correlated(rng, 600, 0.9)[:, None] ** 2
        resampled = np.sqrt(resampled_means([squares], [1], rng)[:, 0])
        low, high = interval95(float(np.sqrt(squares.mean())), resampled, 600)
        held += low < 1.0 < high
    assert held < 0.8 * repeats


def test_the_mean_of_the_resampled_means_is_the_mean_of_all_samples_of_parts_of_any_size():
    rng = np.random.default_rng(3)
    parts = [rng.uniform(0.0, 1.0, (103, 2)), 5.0 + rng.uniform(0.0, 1.0, (40, 2))]
    resampled = resampled_means(parts, [10, 7], rng)
    error = 4.0 * resampled.std(axis=0) / np.sqrt(RESAMPLES)
    assert resampled.mean(axis=0) == pytest.approx(np.concatenate(parts).mean(axis=0), abs=error.max())


def test_columns_share_their_blocks_so_that_a_ratio_of_equals_has_no_spread():
    rng = np.random.default_rng(4)
    squares = rng.chisquare(1.0, (200, 1))
    resampled = resampled_means([np.hstack([squares, 4.0 * squares])], [20], rng)
    assert resampled[:, 1] / resampled[:, 0] == pytest.approx(np.full(RESAMPLES, 4.0))
    assert interval95(2.0, np.sqrt(resampled[:, 1] / resampled[:, 0]), 10) == pytest.approx((2.0, 2.0))
