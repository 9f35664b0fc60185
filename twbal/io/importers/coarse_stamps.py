"""Time stamps of a clock whose ticks are nearly as long as the period, or longer: steps of one tick, and of two.

Such steps look like lost rows. Angles tell: where only the stamps are coarse, they turn as far over a short step as
over a long one; where rows were lost, they turn twice as far over a step of two ticks.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from twbal.core.gaussian import Array
from twbal.core.time_base import places_of
from twbal.io.importers.bunched_stamps import ANGLES, mean_step

FAR = 5
"""Typical steps from which on a step is a gap, and no jitter."""
_MOVING = *ANGLES, "heading", "x", "y", "tilt_rate", "wheel_rate"  # what changes smoothly
_OFF = 0.4  # of a typical step, from which on a step is another number of ticks
_FEWEST = 10  # such steps, and changes of an angle, by which anything is judged
_ON_TICK = 0.15  # of a tick by which a step may be off a number of them: a tick of 15.625 ms may be written as 15 or 16
_ALL, _MOST = 0.98, 0.9  # of the steps, and of those that are another number, are numbers of ticks at least
_NEAR = 0.05  # s before and after a step whose changes tell how fast an angle turns there
_NEAREST, _FARTHEST = 3, 50  # rows that this is at least, and at most
_BLOCKS = 40  # of the rows, each left out once to tell how well the answer is known (jackknife)
_CERTAIN = 3.0  # standard errors by which the answer differs from one half: wrong in 1 of 700 logs
_WINDOW = 30, 20, 14  # rows of a window whose slope is taken: fewer where windows of more have lost rows
_WINDOWS = 20_000  # of these, about
_STRAIGHT = 1.1  # ticks by which stamps of a window without lost rows differ from a straight line in all
_SOME = 0.05  # of the windows that must be straight
_ROUNDS = 6  # of numbering rows by the period, and taking the period from the numbers
_SAME = 1e-7  # share of the period by which it changes at most once it is found


class CoarseStamps(NamedTuple):
    """What coarse stamps tell of an even loop.

    Attributes:
        numbers: of the period in which each row was taken (n,), from 0 on in each part; lost rows have one, too.
        begins: (p,) first rows of the parts between far gaps.
        period: slope of stamps over numbers [s].
        doubt: twice its standard error [s].
        tick: of the clock [s].
        nearby: period by rows that are close together and none of which was lost [s]. It is less than `period` where
            the stamps do not tell of all rows that were lost.
    """

    numbers: NDArray[np.int64]
    begins: NDArray[np.int64]
    period: float
    doubt: float
    tick: float
    nearby: float

    def times(self, stamps: Array, period: float) -> Array:
        """Instants of all rows (n,) at a period of about the slope, with the stamps' mean in each part [s]."""
        even = period * self.numbers
        sizes = np.diff(np.append(self.begins, len(stamps)))
        return np.asarray(even + np.repeat(np.add.reduceat(stamps - even, self.begins) / sizes, sizes))


def coarse_of(stamps: Array, signals: Mapping[str, Array]) -> CoarseStamps | None:
    """The even loop behind coarse stamps; None where stamps are not coarse, or angles do not say that the loop is even.

    Args:
        stamps: of all rows (n,) [s].
        signals: quantities by name, (n,) each.
    """
    steps = np.diff(stamps)
    tick = _tick(steps)
    if not tick:
        return None
    mean = mean_step(stamps)
    most = (np.floor(mean / tick + _ON_TICK) + 1.0 + _ON_TICK) * tick  # of a step in which no row need be lost
    if not are_even(steps, signals, most):
        return None
    begins = np.concatenate([[0], np.flatnonzero((steps < 0.0) | (steps >= FAR * max(mean, tick))) + 1])
    return _numbered(stamps, begins, tick, most)


def are_even(steps: Array, signals: Mapping[str, Array], most: float) -> bool | None:
    """Whether rows are evenly apart, whatever their stamps say; None where it cannot be told.

    The change of each signal over a step is regressed on its mean change over the steps nearby, times one plus a share
    of what the step is longer than the mean. The share is 0 where rows are even, and 1 where they are as far apart as
    their stamps say. Changes that share a row with the step's do not count as nearby: both would have that row's noise.

    Args:
        steps: between stamps (n - 1,) [s].
        signals: quantities by name, (n,) each.
        most: longest step that is asked of [s].
    """
    usual = (steps >= 0.0) & (steps < FAR * float(np.median(steps[steps > 0.0])))
    if usual.sum() < _FEWEST:
        return None
    mean = float(steps[usual].mean())
    near = int(np.clip(round(_NEAR / mean), _NEAREST, _FARTHEST))
    at = np.arange(near + 1, len(steps) - near - 1)
    gaps = np.concatenate([[0], np.cumsum(~usual)])
    at = at[(gaps[at + near + 2] == gaps[at - near - 1]) & (steps[at] <= most)]
    longer = steps[at] / mean - 1.0
    block = at * _BLOCKS // len(steps)
    normal, right = np.zeros((_BLOCKS, 3)), np.zeros((_BLOCKS, 2))  # sums of each block, of all signals
    for values in (signals[name] for name in _MOVING if name in signals):
        changes = np.diff(values)[at]
        if np.count_nonzero(changes) < _FEWEST:
            continue
        pace = (values[at - 1] - values[at - near - 1] + values[at + near + 2] - values[at + 2]) / (2 * near)
        left = changes - pace * float(pace @ changes) / max(float(pace @ pace), 1e-300)
        weight = 1.0 / max(float(left.var()), 1e-300)
        by_pace, by_longer = weight * pace, weight * pace * longer
        terms = by_pace * pace, by_longer * pace, by_longer * pace * longer, by_pace * changes, by_longer * changes
        sums = np.column_stack([np.bincount(block, term, _BLOCKS) for term in terms])
        normal, right = normal + sums[:, :3], right + sums[:, 3:]
    return _answer(normal, right)


def _answer(normal: Array, right: Array) -> bool | None:
    """Whether the share is less than one half (True) or more (False), for certain; None where it may be either.

    Args:
        normal: (b, 3) sums over each block of what makes up the normal equations of pace and share.
        right: (b, 2) their right sides.
    """

    def beyond(normal: Array, right: Array) -> Array:
        """The coefficient of the share less one half of that of the pace, with the sign of the latter, (k,)."""
        a, b, c = normal.T
        determinant = a * c - b * b
        determinant = np.where(determinant > 1e-9 * a * c, determinant, np.nan)
        pace = (c * right[:, 0] - b * right[:, 1]) / determinant
        share = (a * right[:, 1] - b * right[:, 0]) / determinant
        return np.asarray((share - 0.5 * pace) * np.sign(pace))

    (found,) = beyond(normal.sum(axis=0)[None], right.sum(axis=0)[None])
    without = beyond(normal.sum(axis=0) - normal, right.sum(axis=0) - right)
    error = np.sqrt((_BLOCKS - 1) * without.var())
    if not np.isfinite([found, error]).all() or abs(found) <= _CERTAIN * error:
        return None
    return bool(found < 0.0)


def _tick(steps: Array) -> float:
    """The tick of a coarse clock, whose steps differ and are whole numbers of it [s]; 0 of any other clock."""
    typical = float(np.median(steps[steps > 0.0]))
    usual = steps[(steps >= 0.0) & (steps < FAR * typical)] / typical
    odd = np.abs(usual - 1.0) > _OFF
    if odd.sum() < _FEWEST:
        return 0.0
    for ticks in (1, 2):  # of a typical step
        on_tick = np.abs(ticks * usual - np.round(ticks * usual)) < _ON_TICK
        if on_tick.mean() >= _ALL and on_tick[odd].mean() >= _MOST:
            return typical / ticks
    return 0.0


def _numbered(stamps: Array, begins: NDArray[np.int64], tick: float, most: float) -> CoarseStamps:
    """Rows numbered by the period, and the period as the slope of their stamps, in turns."""
    steps = np.diff(stamps)
    nearby = period = _first_period(stamps, tick) or float(steps[(steps >= 0.0) & (steps < most)].mean())
    parts = np.split(stamps, begins[1:])
    for _ in range(_ROUNDS):
        numbers = [_places(part, period, most) for part in parts]
        x = np.concatenate([each - each.mean() for each in numbers])
        y = np.concatenate([part - part.mean() for part in parts])
        before, period = period, float(x @ y / (x @ x))
        if abs(period - before) < _SAME * period:
            break
    doubt = 2.0 * float(np.std(y - period * x)) / float(np.sqrt(x @ x))
    return CoarseStamps(np.concatenate(numbers), begins, period, doubt, tick, nearby)


def _first_period(stamps: Array, tick: float) -> float:
    """Mean slope of windows of rows whose stamps are within a tick of a straight line, so that no row was lost [s].

    It is 0 where there are few such windows.
    """
    for count in (each for each in _WINDOW if len(stamps) >= 2 * each):
        windows = sliding_window_view(stamps, count)[:: max(len(stamps) // _WINDOWS, 1)]
        rows = np.arange(count) - 0.5 * (count - 1)
        windows = windows - windows.mean(axis=1, keepdims=True)
        slopes = windows @ rows / (rows @ rows)
        straight = np.ptp(windows - slopes[:, None] * rows, axis=1) <= _STRAIGHT * tick
        if straight.mean() > _SOME:
            return float(slopes[straight].mean())
    return 0.0


def _places(stamps: Array, period: float, most: float) -> NDArray[np.int64]:
    """Numbers of the rows of one part, from 0 on.

    Stamps of a clock whose tick is a little less than a period fall behind slowly and catch up by a step of two ticks.
    Where most such steps would be lost rows, which angles deny, rows are lost in longer steps alone.

    Args:
        stamps: of the rows (n,) [s].
        period: of the loop [s].
        most: step in which no row need be lost [s].
    """
    numbers, steps = places_of(stamps, period).numbers, np.diff(stamps)
    long = (steps > (1.0 + _OFF) * period) & (steps < most)
    caught_up = int(long.sum()) - int((steps < (1.0 - _OFF) * period).sum())  # a late stamp makes a short step, too
    if 2 * int((np.diff(numbers)[long] > 1).sum()) > max(caught_up, 0):
        counts = np.where(steps < most, 1, np.maximum(np.round(steps / period), 1.0)).astype(np.int64)
        return np.concatenate([[0], np.cumsum(counts)])
    return numbers
