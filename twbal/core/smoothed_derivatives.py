"""Smoothed derivatives of any order of sampled signals, by one kernel for all of them.

Each signal x is replaced by ∫ k(s) x(t - s) ds and its derivatives by ∫ k⁽ᵐ⁾(s) x(t - s) ds, with a bump k of finite
length. Linear differential equations hold between smoothed signals as they do between the signals themselves, so that
nothing is differenced and no state is estimated (modulating functions, Shinbrot 1957).
"""

from math import factorial

import numpy as np
from numpy.polynomial import Polynomial

from twbal.core.gaussian import Array

_BUMP = Polynomial([1.0, 0.0, -1.0]) ** 5  # (1 - x²)⁵ on [-1, 1]: four derivatives vanish at the ends
_SUM = float(_BUMP.integ()(1.0) - _BUMP.integ()(-1.0))
_LENGTHS = (0.12, 0.2, 0.3, 0.45, 0.65)  # s
_FEWEST = 8  # samples in a kernel
_DIFFERENCE = np.array([1.0, -4.0, 6.0, -4.0, 1.0])


def smoothed(values: Array, period: float, length: float, order: int = 0, offset: float = 0.0) -> Array:
    """A smoothed derivative, (n - taps + 1,).

    Args:
        values: (n,).
        period: between samples [s].
        length: of the kernel [s].
        order: of the derivative, 0 to 3.
        offset: by which the values were taken later than their samples [s].
    """
    return np.convolve(values, kernel(period, length, order, offset), mode="valid")


def kernel(period: float, length: float, order: int = 0, offset: float = 0.0) -> Array:
    """The kernel's samples, (taps,), corrected so that they take the derivative of polynomials of that degree exactly.

    Without the correction a large angle would leak into its acceleration, as samples of a kernel do not quite sum to 0.
    """
    half = 0.5 * length
    count = int(half / period)
    at = (period * np.arange(-count, count + 1) - offset) / half
    inside = np.abs(at) < 1.0
    bump = _BUMP(at) * inside
    weights = (_BUMP.deriv(order) if order else _BUMP)(at) * inside / _SUM / half ** (order + 1) * period
    powers = at ** np.arange(order + 1)[:, None]  # (order + 1, taps)
    wanted = np.zeros(order + 1)
    wanted[order] = factorial(order) / (-half) ** order
    wrong = wanted - powers @ weights
    return np.asarray(weights + np.linalg.solve((powers * bump) @ powers.T, wrong) @ (powers * bump))


def noise_sd(values: Array) -> float:
    """Standard deviation of what changes from sample to sample without any order: white noise, rounding steps.

    By fourth differences, which leave little of a motion that is slower than some samples.
    """
    rest = np.convolve(values, _DIFFERENCE, mode="valid")
    return float(np.sqrt(np.mean(rest**2) / (_DIFFERENCE @ _DIFFERENCE))) if len(rest) else 0.0


def lengths(count: int, period: float) -> list[float]:
    """Lengths of kernels that fit a recording of so many samples, from the shortest on [s]."""
    fitting = sorted({max(length, _FEWEST * period) for length in _LENGTHS})
    return [length for length in fitting if 4 * length / period < count]
