r"""A smooth function of one variable, as a Gaussian process in weight space: f(z) = Σ_j β_j φ_j(z).

The weights' prior is β_j ~ N(0, σ² s_j), with s_j the spectrum of a squared-exponential kernel of length ℓ. On an
interval the φ_j are the eigenfunctions of the Laplacian on a wider one (A. Solin, S. Särkkä: Hilbert space methods for
reduced-rank Gaussian process regression, Statistics and Computing 30 (2), 2020, 419-446, eq. 57-58); on a circle they
are sines and cosines, and the kernel is wrapped around it. Each φ_j is taken less its mean over the data: a constant is
none of the function's.
"""

from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array, Mask

_FUNCTIONS = 36  # of an interval; enough for the shortest length (Riutort-Mayol et al., section 4)
_HARMONICS = 24  # of a circle
_WIDER = 2.0  # half width of the interval of the eigenfunctions, in that of the data
_LENGTHS = np.geomspace(0.1, 0.63, 7)
"""Lengths of the kernel that are tried, in half widths of the data, or in rad on a circle.

A longer one would feel the ends of the interval, where the eigenfunctions are 0 (G. Riutort-Mayol et al.: Practical
Hilbert space approximate Bayesian Gaussian processes for probabilistic programming, Statistics and Computing 33, 2023).
"""


class Smooth(NamedTuple):
    """The functions φ_j of a variable.

    Attributes:
        centre: middle of the variable's range, in its unit.
        half: half width of that range; of a circle, its unit over a rad.
        is_periodic: whether the variable is an angle on a circle.
        means: (m,) of φ_j over the data.
    """

    centre: float
    half: float
    is_periodic: bool
    means: Array

    def at(self, values: Array) -> Array:
        """φ_j less its mean at values of the variable (...), (..., m)."""
        return np.asarray(self._raw(values) - self.means)

    def covers(self, values: Array) -> Mask:
        """Whether values lie within the range of the data."""
        return np.asarray(self.is_periodic | (np.abs(values - self.centre) <= self.half))

    def _raw(self, values: Array) -> Array:
        x = (np.asarray(values)[..., None] - self.centre) / self.half
        if self.is_periodic:
            k = np.arange(1, _HARMONICS + 1)
            return np.asarray(np.sqrt(2.0) * np.concatenate([np.sin(k * x), np.cos(k * x)], axis=-1))
        inside = np.clip(x, -_WIDER, _WIDER)
        waves = np.sin(0.5 * np.pi * np.arange(1, _FUNCTIONS + 1) * (inside + _WIDER) / _WIDER)
        return np.asarray(waves / np.sqrt(_WIDER))

    @property
    def spectra(self) -> Array:
        """(L, m) prior variances of the weights, for each length of the kernel and σ = 1."""
        lengths = _LENGTHS[:, None]
        if self.is_periodic:
            k = np.tile(np.arange(1, _HARMONICS + 1), 2)
            shares = np.exp(-0.5 * (lengths * k) ** 2)
            return np.asarray(shares / shares.sum(axis=1, keepdims=True))
        frequencies = 0.5 * np.pi * np.arange(1, _FUNCTIONS + 1) / _WIDER
        return np.asarray(np.sqrt(2.0 * np.pi) * lengths * np.exp(-0.5 * (lengths * frequencies) ** 2))


def smooth_over(values: Array, is_periodic: bool) -> Smooth:
    """Smooth functions of a variable over the range of its values (n,) [its unit, or rad on a circle]."""
    low, high = (0.0, 2.0) if is_periodic else (float(values.min()), float(values.max()))
    centre = 0.0 if is_periodic else 0.5 * (low + high)
    raw = Smooth(centre, max(0.5 * (high - low), 1e-12), is_periodic, np.zeros(1))
    return raw._replace(means=raw.at(values).mean(axis=0))
