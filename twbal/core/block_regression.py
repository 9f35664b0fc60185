"""Linear regression whose standard errors hold for coloured residuals: a jackknife over blocks of time.

A block is longer than the residuals stay correlated, so that estimates without one block each tell how far the estimate
may be off (Künsch 1989). Intervals are those of Student's t with one degree of freedom less than there are blocks.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from twbal.core.gaussian import Array

ERROR_RATE = 1e-4
"""Share of tests that may be wrong by chance: a log is put to some twenty, so that one log in 500 gets a false one."""

CREEP = 0.3
"""Rate of a wheel below which dry friction has not its full size [rad/s], for regressions on its sign."""

_BLOCK = 0.8  # s; balancing robots swing at 0.5 to 3 Hz
_FEWEST, _MOST = 8, 40  # blocks


class Regression(NamedTuple):
    """y = X b + e.

    Attributes:
        coefficients: b, (p,).
        half_widths: of their intervals at `ERROR_RATE`, (p,).
        half_widths95: of their 95 % intervals, (p,).
        explained: share of the variance of y that X explains, from 0 to 1.
        fitted: X b, (n,).
    """

    coefficients: Array
    half_widths: Array
    half_widths95: Array
    explained: float
    fitted: Array


def regression(y: Array, columns: Sequence[Array], period: float) -> Regression:
    """Regress y on the columns and a constant, which is left out of the result.

    Args:
        y: (n,).
        columns: p of them, (n,) each.
        period: between samples [s].
    """
    return jackknife(np.column_stack([*columns, np.ones(len(y))]), y, period, len(columns))


def jackknife(X: Array, y: Array, period: float, count: int) -> Regression:
    """The first `count` coefficients of a regression of y (n,) on X (n, p)."""
    scale = np.sqrt(np.mean(X**2, axis=0))
    scale[scale == 0.0] = 1.0
    Z = X / scale
    blocks = int(np.clip(len(y) * period / _BLOCK, _FEWEST, _MOST))
    rows = np.array_split(np.arange(len(y)), blocks)
    squares = np.array([Z[part].T @ Z[part] for part in rows])  # (blocks, p, p)
    products = np.array([Z[part].T @ y[part] for part in rows])  # (blocks, p)
    b = np.linalg.pinv(squares.sum(axis=0)) @ products.sum(axis=0)
    rest = squares.sum(axis=0) - squares, products.sum(axis=0) - products
    without = np.array([np.linalg.pinv(S) @ v for S, v in zip(*rest, strict=True)])
    variance = (blocks - 1) / blocks * ((without - without.mean(axis=0)) ** 2).sum(axis=0)
    errors = (np.sqrt(variance) / scale)[:count]
    quantile, quantile95 = stdtrit(blocks - 1, [1.0 - 0.5 * ERROR_RATE, 0.975]).tolist()
    fitted = Z @ b
    spread = float(np.var(y))
    explained = float(np.clip(1.0 - np.var(y - fitted) / spread, 0.0, 1.0)) if spread else 0.0
    return Regression((b / scale)[:count], quantile * errors, quantile95 * errors, explained, fitted)
