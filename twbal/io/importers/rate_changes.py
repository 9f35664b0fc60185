"""Rows at which the rate of a log changes for good, as where two recordings of different rates are one file."""

from collections.abc import Iterator
from itertools import islice, pairwise
from typing import NamedTuple

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d

from twbal.core.gaussian import Array

_SMOOTHED = 11  # steps whose median is taken, in which a lost row or one that is late does not show
_LEAST = 1.1  # times the step before or after, from which on the rate is another
_APART = 0.9  # of the steps on either side are nearer to that side's than to the other's
_CERTAIN = 6.0  # standard errors by which steps on either side differ at least
_MOST = 30  # places at which the rate may change; where there are more, it wanders
_FAR = 3.0  # median steps from which on a step is a gap
_SMALL = 0.02  # difference of two logarithms of steps that is none
_TINY = 1e-3  # of the median step, for those that are 0


class RateChange(NamedTuple):
    """A change of the rate.

    Attributes:
        row: from which on rows come at the new rate.
        before: step before it, in the median [s].
        after: step after it, in the median [s].
    """

    row: int
    before: float
    after: float


def rate_changes(steps: Array, least: int) -> list[RateChange]:
    """Where steps become longer or shorter by more than a tenth, and stay so; empty where they do not.

    Steps that jitter, or stamps of a coarse clock, are no change: nearly all steps before it differ from those after
    it, and so do both the medians and the means of the steps on either side.

    Args:
        steps: between rows (n,) [s].
        least: steps with one rate in a row.
    """
    usual = float(np.median(steps))
    if len(steps) < 2 * least or usual <= 0.0:
        return []
    smoothed = np.log(np.maximum(median_filter(steps, _SMOOTHED, mode="nearest"), _TINY * usual))
    splits = list(islice(_splits(smoothed, 0, len(steps), least), _MOST + 1))
    if len(splits) > _MOST:
        return []
    rows = [0, *sorted(splits), len(steps)]
    weak = [_weakness(steps, smoothed, *ends) for ends in zip(rows[:-2], rows[1:-1], rows[2:], strict=True)]
    while weak and min(weak) < np.inf:
        at = int(np.argmin(weak))
        del rows[at + 1], weak[at]
        for near in range(max(at - 1, 0), min(at + 1, len(weak))):  # whose one side is longer now
            weak[near] = _weakness(steps, smoothed, *rows[near : near + 3])
    means = uniform_filter1d(steps, _SMOOTHED, mode="nearest")  # of which nearly none has a gap or a lost row in it
    told = [float(np.median(means[slice(*ends)])) for ends in pairwise(rows)]
    return [RateChange(row, *around) for row, around in zip(rows[1:-1], pairwise(told), strict=True)]


def _weakness(steps: Array, smoothed: Array, begin: int, at: int, end: int) -> float:
    """How little the rate changes at a row between two others, as a difference of logarithms; or else infinite."""
    before, after = slice(begin, at), slice(at, end)
    if _differ(steps[before], steps[after]) and _are_apart(smoothed[before], smoothed[after]):
        return np.inf
    return abs(float(np.median(smoothed[before]) - np.median(smoothed[after])))


def _splits(smoothed: Array, begin: int, end: int, least: int) -> Iterator[int]:
    """Rows from `begin` to `end` at which the rate may change, in any order, as the means before and after differ."""
    count = end - begin
    if count < 2 * least:
        return
    sums = np.cumsum(smoothed[begin:end] - smoothed[begin:end].mean())[:-1]
    first = np.arange(1, count)
    sizes = np.abs(sums) / np.sqrt(first * (count - first) / count)  # of a change there, as shares of chance
    sizes[: least - 1] = sizes[count - least :] = 0.0
    at = begin + 1 + int(np.argmax(sizes))
    before, after = smoothed[begin:at], smoothed[at:end]
    if abs(before.mean() - after.mean()) > max(_CERTAIN * _error(before, after), _SMALL):
        yield at
        yield from _splits(smoothed, begin, at, least)
        yield from _splits(smoothed, at, end, least)


def _differ(before: Array, after: Array) -> bool:
    """Whether both medians and means of steps that are no gaps differ by more than a tenth, and in the same direction.

    Lost rows change means alone. Coarse clocks change medians alone.
    """
    a, b = float(np.median(before)), float(np.median(after))
    if min(a, b) <= 0.0:
        return False
    means = [float(each[each < _FAR * middle].mean()) for each, middle in ((before, a), (after, b))]
    ratios = a / b, means[0] / means[1]
    return min(ratios) > _LEAST or max(ratios) < 1.0 / _LEAST


def _are_apart(before: Array, after: Array) -> bool:
    """Whether nearly all logarithms of steps on either side are nearer to that side's median, and not by chance."""
    a, b = float(np.median(before)), float(np.median(after))
    if abs(a - b) <= _CERTAIN * _error(before, after):
        return False
    own = [float(np.mean(np.abs(each - x) < np.abs(each - y))) for each, x, y in ((before, a, b), (after, b, a))]
    return min(own) >= _APART


def _error(before: Array, after: Array) -> float:
    """Standard error of the difference of two means of smoothed values, of which so many neighbours are alike."""
    return float(np.sqrt(_SMOOTHED * (before.var() / len(before) + after.var() / len(after))))
