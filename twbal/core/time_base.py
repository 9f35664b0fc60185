"""Samples of a loop that is not even, put on an even time base: uneven instants, and rows that were lost."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from twbal.core.gaussian import Array, Mask

LATE = 0.5
"""Share of a control period by which an instant may be off and its sample be moved to where it belongs."""
_FOLLOWED = 0.05  # share of an instant's deviation by which those after it are expected: clocks run fast or slow
_AHEAD = 8  # rows within which those that are late catch up
_NEAR = 51  # samples whose mean deviation is not that of one instant
_EVEN = 1e-6  # share of a control period by which the instants of an even loop vary
_FEW = 5  # samples of which nothing is said
_LEAST = 1e-24  # variance of an angle that does not move


class Even(NamedTuple):
    """Samples at even instants.

    Attributes:
        values: (K + 1, C).
        commands: (K,), each of which acted between an instant and the next.
        measured: (K + 1,), False at instants whose row was lost: their values are interpolated.
    """

    values: Array
    commands: Array
    measured: Mask


class Places(NamedTuple):
    """Where samples lie on an even time base.

    Attributes:
        numbers: (T + 1,) of their instants, from 0 on.
        late: (T + 1,) by which they were taken after these [s].
    """

    numbers: NDArray[np.int64]
    late: Array


def places_of(times: Array, period: float) -> Places:
    """The instant of each sample, by its time stamp.

    Expected instants follow the stamps slowly, so a clock that runs fast or slow moves no sample. A row was lost only
    if those after it do not catch up: packets may arrive in bunches.

    Args:
        times: (T + 1,) that increase [s].
        period: control period [s].
    """
    numbers, late = np.zeros(len(times), np.int64), np.zeros(len(times))
    origin = float(times[0])
    for n in range(1, len(times)):
        coming = (times[n : n + _AHEAD] - origin) / period
        here = round(float((coming - np.arange(len(coming))).min()))
        numbers[n] = max(int(numbers[n - 1]) + 1, here)
        late[n] = times[n] - origin - numbers[n] * period
        origin += _FOLLOWED * late[n]
    return Places(numbers, late)


def evened(
    times: Array, values: Array, commands: Array, period: float, angles: Sequence[int], rates: Sequence[int]
) -> Even:
    """Samples at the instants of an even loop.

    A loop that is late by δ reads an angle that has moved on by δ times its rate, so angles are moved back by that, and
    rates by δ times their change in the period that ends, or, of an early loop, that begins then. A command that comes
    late leaves the one before it more time: each is replaced by the mean of what acted between two even instants.
    Stamps may jitter where the loop does not: all this is done only if changes of the angles follow the stamps. What
    was lost is interpolated.

    Args:
        times: (T + 1,) that increase [s].
        values: (T + 1, C).
        commands: (T,).
        period: control period [s].
        angles: columns of `values` that are.
        rates: columns of `values` that change with the commands.
    """
    if len(times) < _FEW:
        return Even(values, commands, np.ones(len(times), bool))
    numbers, late = places_of(times, period)
    if np.abs(late).max() > _EVEN * period:
        values = values.copy()
        late = late - uniform_filter1d(late, _NEAR, mode="nearest")  # what stays is a clock that runs fast or slow
        late = np.where(np.abs(late) <= LATE * period, late, 0.0)
        moved = late[:, None] * np.gradient(values[:, angles], times, axis=0)
        if _follow(values[:, angles], moved, numbers) > 0.5:
            values[:, angles] -= moved
            values[:, rates] -= late[:, None] * _slopes(values[:, rates], times, late)
            commands = _means(commands, late / period, numbers)
    every = np.arange(numbers[-1] + 1)
    measured = np.zeros(len(every), bool)
    measured[numbers] = True
    if not measured.all():
        values = np.column_stack([np.interp(every, numbers, column) for column in values.T])
        commands = np.repeat(commands, np.diff(numbers))
    return Even(values, commands, measured)


def _slopes(rates: Array, times: Array, late: Array) -> Array:
    """Slopes (T + 1, C) of rates at each sample: before it where that is late, after it where it is early.

    A command changes at the sample, and with it the slope.
    """
    steps = np.diff(rates, axis=0) / np.diff(times)[:, None]
    before, after = np.concatenate([steps[:1], steps]), np.concatenate([steps, steps[-1:]])
    return np.where(late[:, None] > 0.0, before, after)


def _means(commands: Array, late: Array, numbers: NDArray[np.int64]) -> Array:
    """Means (T,) of the commands over periods of an even loop, where each came late by a share of a period, or early.

    Where rows were lost between two samples, their command acts longer, and what its neighbours take of it is less.
    """
    lengths = np.diff(numbers)
    before, after = np.concatenate([commands[:1], commands[:-1]]), np.concatenate([commands[1:], commands[-1:]])
    means = commands + np.maximum(late[:-1], 0.0) / lengths * (before - commands)
    return np.asarray(means + np.maximum(-late[1:], 0.0) / lengths * (after - commands))


def _follow(angles: Array, moved: Array, numbers: NDArray[np.int64]) -> float:
    """Share of what a loop's jitter would do to angles that is found in them: about 1, or 0 where only stamps jitter.

    It is the slope of a regression of their second differences, in which a smooth motion leaves little, with each
    channel weighted by its noise.

    Args:
        angles: (T + 1, C).
        moved: (T + 1, C) what jitter would do to them.
        numbers: (T + 1,) of the instants; second differences over lost rows do not count.
    """
    whole = np.diff(numbers, 2) + 2 * np.diff(numbers)[:-1] == 2
    found, wanted = np.diff(angles, 2, axis=0)[whole], np.diff(moved, 2, axis=0)[whole]
    weights = 1.0 / np.maximum(found.var(axis=0), _LEAST)
    power = float((weights * wanted**2).sum())
    return float((weights * found * wanted).sum()) / power if power > 0.0 else 0.0
