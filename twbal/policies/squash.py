"""The squash of eq. 10, u = u_max σ(a) with σ(a) = (9 sin a + sin 3a) / 8, and its moments at a normal a."""

from typing import NamedTuple

import numpy as np

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array

_AMPLITUDES = ((1.0, 9 / 8), (3.0, 1 / 8))  # σ(a) = Σ amplitude · sin(frequency · a)


def squash(activation: Array) -> Array:
    """σ(a) in [-1, 1], any shape (eq. 10)."""
    # At its flat top the sum rounds to a little more than 1.
    return np.clip((9.0 * np.sin(activation) + np.sin(3.0 * activation)) / 8.0, -1.0, 1.0)


class Squashed(NamedTuple):
    """Moments of σ(a), a ~ N(m, v), and their derivatives.

    Attributes:
        mean: E[σ(a)].
        gain: E[σ'(a)], so that Cov(x, σ(a)) = gain · Cov(x, a).
        variance: Var[σ(a)].
        mean_by, gain_by, variance_by: derivatives of each by (m, v), (2,).
    """

    mean: float
    gain: float
    variance: float
    mean_by: Array
    gain_by: Array
    variance_by: Array


@kernel()
def squash_moments(m: float, v: float) -> Squashed:
    """Moments of σ(a) for a ~ N(m, v), in closed form.

    E[sin ja] = exp(-j²v/2) sin jm, and Cov(sin ja, sin la) = ½ (1 - exp(-jlv)) (n cos (j - l)m + f cos (j + l)m) with
    n = exp(-½(j - l)²v) and f = exp(-½(j² + l²)v). By expm1 a small v loses no digits, and a large one does not
    overflow.
    """
    mean = gain = variance = 0.0
    mean_by, gain_by, variance_by = np.zeros(2), np.zeros(2), np.zeros(2)
    for j, p in _AMPLITUDES:
        fade, s, c = np.exp(-0.5 * j * j * v), np.sin(j * m), np.cos(j * m)
        mean += p * fade * s
        mean_by += p * fade * np.array([j * c, -0.5 * j * j * s])
        gain += p * fade * j * c
        gain_by += p * fade * j * np.array([-j * s, -0.5 * j * j * c])
        for l, q in _AMPLITUDES:
            near, far = np.exp(-0.5 * (j - l) ** 2 * v), np.exp(-0.5 * (j * j + l * l) * v)
            apart, near_cos, far_cos = -np.expm1(-j * l * v), np.cos((j - l) * m), np.cos((j + l) * m)
            variance += 0.5 * p * q * apart * (near * near_cos + far * far_cos)
            by_m = -apart * (near * (j - l) * np.sin((j - l) * m) + far * (j + l) * np.sin((j + l) * m))
            by_v = j * l * (1.0 - apart) * (near * near_cos + far * far_cos)
            by_v -= 0.5 * apart * ((j - l) ** 2 * near * near_cos + (j * j + l * l) * far * far_cos)
            variance_by += 0.5 * p * q * np.array([by_m, by_v])
    return Squashed(mean, gain, max(variance, 0.0), mean_by, gain_by, variance_by)
