"""Where a series of moment matching is cut, and what is left out by that."""

from typing import NamedTuple

import numpy as np

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array
from twbal.models.moments.multi_index import Integers, MultiIndices, multi_indices

DEGREES = (2, 4, 6, 8, 10)
"""Degrees p of the covariance series that are tried in turn; derivatives take two degrees more."""

EXACT = 0
"""As a degree: no series, the sum over pairs."""

LOWEST = 3  # degree of the derivatives that mean, slope and their ways back need

_SLOWEST_FALL = 0.9  # a series that falls slower than that is not trusted anyway


class Truncation(NamedTuple):
    """How far to trust a short series.

    Attributes:
        tolerance: largest error, as a share of an output's variance (or of a `reference` above it), of covariances and
            their derivatives; estimated from the two degrees past the last.
        degrees: allowed degrees, rising; empty always sums over pairs.
        fall_back: sum over pairs where no degree is enough; otherwise the highest degree serves, and the covariance is
            too small by what it leaves out.
    """

    tolerance: float = 1e-6
    degrees: tuple[int, ...] = DEGREES
    fall_back: bool = True


class Series(NamedTuple):
    """A truncation for d inputs, as compiled code takes it.

    Attributes:
        tolerance, degrees, fall_back: see `Truncation`; degrees (k,).
        indices: multi-indices up to two degrees past the last.
    """

    tolerance: float
    degrees: Integers
    fall_back: bool
    indices: MultiIndices


def series(truncation: Truncation, dimension: int) -> Series:
    """The tables of a truncation, for `dimension` inputs."""
    highest = max((p + 2 for p in truncation.degrees), default=LOWEST)
    degrees = np.array(truncation.degrees, dtype=np.int64)
    return Series(float(truncation.tolerance), degrees, truncation.fall_back, multi_indices(dimension, highest))


@kernel()
def left_out(variances: Array, reference: Array, p: int) -> float:
    """Bound, by all we have seen, on what a series up to degree p leaves out of a variance and of its derivatives.

    As a share of the variance, derivatives in units of S's own size. A degree q of size v_q takes part in them with
    some 2q v_q. The two degrees past p are known (two, as one may vanish by symmetry); later ones go on falling as
    these two fell from the two before.
    """
    share = 0.0
    for a in range(len(variances)):
        v = variances[a]
        whole = max(v[1:].sum(), reference[a], 1e-300)
        fall = (v[p + 1] + v[p + 2]) / max(v[p - 1] + v[p], 1e-300)
        known = 2.0 * ((p + 1) * v[p + 1] + (p + 2) * v[p + 2])
        share = max(share, known / (1.0 - min(fall, _SLOWEST_FALL)) / whole)
    return share
