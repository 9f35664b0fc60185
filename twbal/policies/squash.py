"""The squash of eq. 10, u = u_max σ(a) with σ(a) = (9 sin a + sin 3a) / 8, and its moments at a normal a.

Beyond the paper, a share c of the torque limit can be kept for friction compensation: a motor with a dead zone or dry
friction answers nothing to small commands, so the command jumps where a changes its sign,

    σ_c(a) = (1 - c) σ(a) + c s(a),

with s the square wave of period 2π, sign(sin a), smoothed by a normal density of width w:
s(a) = Σ_{j odd} 4 / (π j) exp(-½ j²w²) sin ja. Near a = 0 that is erf(a / √2 w): the command changes its sign within
about ±2w. Both are sums of sines, whose moments have closed forms.
"""

from functools import lru_cache
from math import erf
from typing import NamedTuple

import numpy as np
from scipy.special import erf as erf_of_arrays

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array

COMPENSATION_WIDTH = 0.04
"""w of policies that do not tell theirs, in units of the activation."""
NARROWEST, WIDEST = 0.003, 0.3
"""Of w: the narrower the jump, the longer the series; beyond the widest it is no jump."""
_AMPLITUDES = ((1.0, 9 / 8), (3.0, 1 / 8))  # σ(a) = Σ amplitude · sin(frequency · a)
_REACH = 4.1  # j w of the last harmonic of the square wave: what is left out is below 1e-5
_NEGLIGIBLE = 1e-13  # of a harmonic that the variance of a fades


def squash(activation: Array, compensation: float = 0.0, width: float = COMPENSATION_WIDTH) -> Array:
    """σ_c(a) in [-1, 1], any shape (eq. 10, with friction compensation of the share c and the width w)."""
    # At its flat top the sum rounds to a little more than 1.
    smooth: Array = np.clip((9.0 * np.sin(activation) + np.sin(3.0 * activation)) / 8.0, -1.0, 1.0)
    if compensation == 0.0:
        return smooth
    folded = np.arcsin(np.sin(activation))  # within ±π/2, where the other flanks of the wave are far away
    step: Array = erf_of_arrays(folded / (np.sqrt(2.0) * width))
    return (1.0 - compensation) * smooth + compensation * step


class Compensation(NamedTuple):
    """Friction compensation as compiled code takes it.

    Attributes:
        share: c in [0, 1).
        width: w.
        amplitudes: (n,) of sin ja, j = 1, 3, 5, ...; empty without compensation.
        products: (n_2,) amplitudes of cos ja in σ_c(a)², j = 0, 2, 4, ...; likewise.
    """

    share: float
    width: float
    amplitudes: Array
    products: Array


@lru_cache(maxsize=64)
def compensation_of(share: float, width: float = COMPENSATION_WIDTH) -> Compensation:
    """The Fourier series of σ_c and of its square; w is at least `NARROWEST`."""
    if share == 0.0:
        return Compensation(0.0, width, np.zeros(0), np.zeros(0))
    harmonics = int(0.5 * _REACH / width) + 1
    j = 2.0 * np.arange(harmonics) + 1.0
    amplitudes = share * 4.0 / (np.pi * j) * np.exp(-0.5 * (j * width) ** 2)
    amplitudes[:2] += (1.0 - share) * np.array([9 / 8, 1 / 8])
    # sin ja sin la = ½ (cos (j - l)a - cos (j + l)a)
    apart = np.correlate(amplitudes, amplitudes, "full")[harmonics - 1 :]  # Σ b_j b_{j + 2k}, k = 0, 1, ...
    together = np.convolve(amplitudes, amplitudes)  # Σ b_j b_l with j + l = 2k + 2
    products = np.zeros(2 * harmonics)
    products[:harmonics] += apart
    products[0] *= 0.5
    products[1:] -= 0.5 * together
    return Compensation(share, width, amplitudes, products)


@kernel()
def squashed(activation: float, compensation: Compensation) -> float:
    """σ_c(a) of one activation."""
    smooth = min(max((9.0 * np.sin(activation) + np.sin(3.0 * activation)) / 8.0, -1.0), 1.0)
    if compensation.share == 0.0:
        return float(smooth)
    folded = np.arcsin(np.sin(activation))
    step = erf(folded / (np.sqrt(2.0) * compensation.width))
    return float((1.0 - compensation.share) * smooth + compensation.share * step)


class Squashed(NamedTuple):
    """Moments of σ_c(a), a ~ N(m, v), and their derivatives.

    Attributes:
        mean: E[σ_c(a)].
        gain: E[σ_c'(a)], so that Cov(x, σ_c(a)) = gain · Cov(x, a).
        variance: Var[σ_c(a)].
        mean_by, gain_by, variance_by: derivatives of each by (m, v), (2,).
    """

    mean: float
    gain: float
    variance: float
    mean_by: Array
    gain_by: Array
    variance_by: Array


@kernel()
def squash_moments(m: float, v: float, compensation: Compensation) -> Squashed:
    """Moments of σ_c(a) for a ~ N(m, v), in closed form.

    E[sin ja] = exp(-j²v/2) sin jm and E[cos ja] = exp(-j²v/2) cos jm.
    """
    if compensation.share == 0.0:
        return _plain_moments(m, v)
    mean = gain = square = 0.0
    mean_by, gain_by, square_by = np.zeros(2), np.zeros(2), np.zeros(2)
    for i, p in enumerate(compensation.amplitudes):
        j = 2.0 * i + 1.0
        faded = np.exp(-0.5 * j * j * v)
        if faded < _NEGLIGIBLE:
            break
        fade, s, c = p * faded, np.sin(j * m), np.cos(j * m)
        mean += fade * s
        mean_by[0] += fade * j * c
        mean_by[1] -= fade * 0.5 * j * j * s
        gain += fade * j * c
        gain_by[0] -= fade * j * j * s
        gain_by[1] -= fade * 0.5 * j * j * j * c
    for i, p in enumerate(compensation.products):
        j = 2.0 * i
        faded = np.exp(-0.5 * j * j * v)
        if faded < _NEGLIGIBLE:
            break
        fade, s, c = p * faded, np.sin(j * m), np.cos(j * m)
        square += fade * c
        square_by[0] -= fade * j * s
        square_by[1] -= fade * 0.5 * j * j * c
    return Squashed(mean, gain, max(square - mean * mean, 0.0), mean_by, gain_by, square_by - 2.0 * mean * mean_by)


@kernel()
def _plain_moments(m: float, v: float) -> Squashed:
    """Without compensation.

    Cov(sin ja, sin la) = ½ (1 - exp(-jlv)) (n cos (j - l)m + f cos (j + l)m) with n = exp(-½(j - l)²v) and
    f = exp(-½(j² + l²)v). By expm1 a small v loses no digits, and a large one does not overflow.
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
