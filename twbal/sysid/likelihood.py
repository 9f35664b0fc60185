"""The likelihood of prediction errors.

They are taken to be of Student's t distribution, with the filter's covariance and as many dimensions as channels were
measured: a shove or a landing at the start then bears on the fit by no more than a few ordinary instants.
"""

from collections.abc import Sequence

import numpy as np

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array, Mask
from twbal.sysid.kalman import Filter

TAIL = 10.0
"""Degrees of freedom of the errors' distribution."""


@kernel()
def _square(errors: Array, W: Array, white: Array) -> float:
    """Squared length of W e, which is written to `white`."""
    total = 0.0
    for i in range(4):
        white[i] = 0.0
        for j in range(i + 1):
            white[i] += W[i, j] * errors[j]
        total += white[i] * white[i]
    return total


@kernel()
def _heavy(square: float, dimension: int) -> float:
    """-2 log density, but for a constant, of errors of a squared length: Student's t of unit covariance."""
    tail: float = (TAIL + dimension) * np.log1p(square / (TAIL - 2.0))
    return tail


@kernel()
def _cost(errors: Array, usable: Mask, whiteners: Array, determinants: Array, dimension: int) -> float:
    """-2 log likelihood of prediction errors, but for a constant; the first instant does not count."""
    total = 0.0
    last, white = len(whiteners) - 1, np.empty(4)
    for n in range(1, len(errors)):
        if usable[n]:
            square = _square(errors[n], whiteners[min(n, last)], white)
            total += determinants[min(n, last)] + _heavy(square, dimension)
    return total


@kernel()
def whiten(errors: Array, usable: Mask, whiteners: Array, dimension: int) -> Array:
    """Prediction errors decorrelated, (T, 4), 0 where they do not count.

    They are scaled such that their squares add up to -2 log likelihood: about standard deviations where they are small,
    and less where they are large.
    """
    last = len(whiteners) - 1
    white = np.zeros((len(errors) - 1, 4))
    for n in range(1, len(errors)):
        if usable[n]:
            square = _square(errors[n], whiteners[min(n, last)], white[n - 1])
            white[n - 1] *= np.sqrt(_heavy(square, dimension) / max(square, 1e-12))
    return white


@kernel()
def robustify(errors: Array, usable: Mask, whiteners: Array, dimension: int) -> Array:
    """Prediction errors (T, 4) in their units, 0 where they do not count and less where they are large."""
    last, white = len(whiteners) - 1, np.empty(4)
    robust = np.zeros((len(errors) - 1, 4))
    for n in range(1, len(errors)):
        if usable[n]:
            square = _square(errors[n], whiteners[min(n, last)], white)
            robust[n - 1] = errors[n] * np.sqrt(_heavy(square, dimension) / max(square, 1e-12))
    return robust


def cost(errors: list[Array], usable: list[Mask], kalman: Filter) -> float:
    """-2 log likelihood of the prediction errors of several recordings, but for a constant."""
    of = kalman.whiteners, kalman.log_determinants, kalman.measured
    return float(sum(_cost(e, u, *of) for e, u in zip(errors, usable, strict=True)))


def weights_of(errors: Sequence[Array], usable: Sequence[Mask], kalman: Filter) -> list[Array]:
    """Roots of the weights that Student's t gives instants, (T + 1,) of each recording, 0 where they do not count.

    They are so scaled that weighted errors are of the size that the filter takes them to have.
    """
    found, power, count = [], 0.0, 0
    for each, counts in zip(errors, usable, strict=True):
        W = kalman.whiteners[np.minimum(np.arange(len(each)), len(kalman.whiteners) - 1)]
        squares = ((W @ each[:, :, None])[:, :, 0] ** 2).sum(axis=1)
        counts = counts & (np.arange(len(each)) > 0)
        weights = counts * (TAIL + kalman.measured) / (TAIL - 2.0 + squares)
        power, count = power + float(weights @ squares), count + kalman.measured * int(counts.sum())
        found.append(weights)
    return [np.sqrt(weights * count / power) for weights in found]


def whitened(kalman: Filter, weights: Sequence[Array], parts: Sequence[Array]) -> Array:
    """Errors of each recording, or columns of them, whitened, weighted and flat.

    Args:
        kalman: filter whose errors they are.
        weights: (T + 1,) of each recording, roots of the instants' weights.
        parts: (T + 1, 4) or (T + 1, 4, m) of each recording.

    Returns:
        (N,) or (N, m), without the first instants.
    """
    found = []
    for part, own in zip(parts, weights, strict=True):
        rows = np.minimum(np.arange(len(part)), len(kalman.whiteners) - 1)
        W = kalman.whiteners[rows] * own[:, None, None]
        white = W @ (part[:, :, None] if part.ndim == 2 else part)  # (T + 1, 4, m)
        found.append(white[1:].reshape(4 * (len(part) - 1), -1))
    stacked = np.concatenate(found)
    return stacked[:, 0] if parts[0].ndim == 2 else stacked
