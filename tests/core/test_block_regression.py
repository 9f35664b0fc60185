"""Intervals of a regression by a jackknife over blocks."""

import numpy as np

from twbal.core.block_regression import regression

PERIOD = 0.01


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


def test_95_per_cent_intervals_hold_that_often():
    """Few blocks: by a ratio of normal quantiles instead of those of Student's t they hold 99 %."""
    rng = np.random.default_rng(1)
    inside = 0
    for _ in range(400):
        x, e = rng.standard_normal((2, 900))  # 9 s, 11 blocks
        fit = regression(1.0 + 2.0 * x + e, [x], PERIOD)
        inside += abs(fit.coefficients[0] - 2.0) <= fit.half_widths95[0]
    assert 0.93 <= inside / 400 <= 0.975
