"""Samples of a loop that is not even, put on an even time base: uneven instants, and rows that were lost."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from twbal.core.gaussian import Array, Mask
from twbal.core.lost_rows import refilled

LATE = 0.5
"""Share of a control period by which an instant may be off and its sample be moved to where it belongs."""
_FOLLOWED = 0.05  # share of an instant's deviation by which those after it are expected: clocks run fast or slow
_AHEAD = 8  # rows within which those that are late catch up
_NEAR = 51  # samples whose mean deviation is not that of one instant
_STEADY = 2.0  # times the deviation of the mean of so many white ones, which it may have beside a steady clock
_EVEN = 1e-6  # share of a control period by which the instants of an even loop vary, but for the stamps' digits
_TOLD = 4.0  # of `wanted`, below which an uneven loop and an even one are as likely as each other, within 2 nats
_FEW = 5  # samples of which nothing is said
_LEAST = 1e-24  # variance of an angle that does not move


class Even(NamedTuple):
    """Samples at even instants.

    Attributes:
        values: (K + 1, C).
        commands: (K,), each of which acted between an instant and the next.
        sent: (K,), what was commanded as each sample was taken; `commands` are their means.
        measured: (K + 1,), False at instants whose row was lost: their values are worked out from the others.
        late: (K + 1,) by which each sample was taken after its instant [s]; 0 where nothing was moved.
    """

    values: Array
    commands: Array
    sent: Array
    measured: Mask
    late: Array


class LoopJitter(NamedTuple):
    """What angles tell of whether a loop is as uneven as its time stamps.

    Attributes:
        found: of the changes that such a loop would make, how much is in the angles.
        wanted: how much it would make; 0 where the stamps are even.
    """

    found: float
    wanted: float


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
    times: Array,
    values: Array,
    commands: Array,
    period: float,
    angles: Sequence[int],
    rates: Sequence[int],
    uneven: bool,
) -> Even:
    """Samples at the instants of an even loop.

    A loop that is late by δ reads an angle that has moved on by δ times its rate, so angles are moved back by that, and
    rates by δ times their change in the period that ends, or, of an early loop, that begins then. A command that comes
    late leaves the one before it more time: each is replaced by the mean of what acted between two even instants.
    Rows that were lost are filled (`refilled`), or else interpolated.

    Args:
        times: (T + 1,) that increase [s].
        values: (T + 1, C).
        commands: (T,).
        period: control period [s].
        angles: columns of `values` that are.
        rates: columns of `values` that change with the commands.
        uneven: whether the loop is as uneven as its stamps (`is_uneven`); else only lost rows are made up for.
    """
    if len(times) < _FEW:
        return Even(values, commands, commands, np.ones(len(times), bool), np.zeros(len(times)))
    numbers, late = _late(times, period)
    every = np.arange(numbers[-1] + 1)
    measured, moved_by = np.zeros(len(every), bool), np.zeros(len(every))
    measured[numbers] = True
    if uneven and np.abs(late).max() > _least(times, period):
        values = values.copy()
        moved = late[:, None] * np.gradient(values[:, angles], times, axis=0)
        values[:, angles] -= moved
        values[:, rates] -= late[:, None] * _slopes(values[:, rates], times, late)
        moved_by[numbers] = late
    if not measured.all():
        values = np.column_stack([np.interp(every, numbers, column) for column in values.T])
        commands = np.repeat(commands, np.diff(numbers))
    means = means_over_periods(commands, moved_by / period)
    if not measured.all():
        values, means = refilled(values, means, measured)
        commands = np.where(measured[:-1], commands, means)
    return Even(values, means, commands, measured, moved_by)


def pace_of(times: Array, angles: Array, period: float) -> LoopJitter:
    """What one recording tells of whether its loop is as uneven as its stamps: these may jitter where it does not.

    A motion is smooth, so it leaves little in second differences of its angles; there the changes that an uneven loop
    would make are looked for, with each channel weighted by its noise.

    Args:
        times: (T + 1,) that increase [s].
        angles: (T + 1, C).
        period: control period [s].
    """
    if len(times) < _FEW:
        return LoopJitter(0.0, 0.0)
    numbers, late = _late(times, period)
    if np.abs(late).max() <= _least(times, period):
        return LoopJitter(0.0, 0.0)
    moved = late[:, None] * np.gradient(angles, times, axis=0)
    whole = np.diff(numbers, 2) + 2 * np.diff(numbers)[:-1] == 2  # differences over lost rows do not count
    found, wanted = np.diff(angles, 2, axis=0)[whole], np.diff(moved, 2, axis=0)[whole]
    weights = 1.0 / np.maximum(found.var(axis=0), _LEAST)
    return LoopJitter(float((weights * found * wanted).sum()), float((weights * wanted**2).sum()))


def is_uneven(paces: Sequence[LoopJitter]) -> bool:
    """Whether the loop of one robot is as uneven as its stamps, by all of its recordings.

    Together they tell it where one alone could not: the slope of found on wanted is about 1, or 0 where only the stamps
    jitter. Where the stamps jitter so little that both are nearly as likely, the loop is taken for an even one.
    """
    wanted = sum(pace.wanted for pace in paces)
    return wanted > _TOLD and sum(pace.found for pace in paces) > 0.5 * wanted


def _least(times: Array, period: float) -> float:
    """By how much stamps of an even loop may be off [s]: a little of the period, or their last digits."""
    return max(_EVEN * period, 4.0 * float(np.spacing(np.abs(times).max())))


def _late(times: Array, period: float) -> tuple[NDArray[np.int64], Array]:
    """Numbers of the instants (T + 1,), and how late each sample was taken [s], beside a clock that is fast or slow.

    Where samples are late each by itself, such a clock is a straight line through all stamps. Else it wanders, and is
    the mean of those near each.
    """
    numbers, late = places_of(times, period)
    if np.abs(late).max() > _least(times, period):
        off = times - np.polyval(np.polyfit(numbers, times, 1), numbers)
        slow = uniform_filter1d(off, _NEAR, mode="nearest")
        is_steady = np.std(slow) < _STEADY * np.std(off - slow) / np.sqrt(_NEAR)
        late = off if is_steady else late - uniform_filter1d(late, _NEAR, mode="nearest")
    return numbers, np.where(np.abs(late) <= LATE * period, late, 0.0)


def _slopes(rates: Array, times: Array, late: Array) -> Array:
    """Slopes (T + 1, C) of rates at each sample: before it where that is late, after it where it is early.

    A command changes at the sample, and with it the slope.
    """
    steps = np.diff(rates, axis=0) / np.diff(times)[:, None]
    before, after = np.concatenate([steps[:1], steps]), np.concatenate([steps, steps[-1:]])
    return np.where(late[:, None] > 0.0, before, after)


def means_over_periods(commands: Array, late: Array) -> Array:
    """Means (K,) of commands over periods of an even loop, where each came late by a share of a period, or early."""
    if not late.any():
        return commands
    before, after = np.concatenate([commands[:1], commands[:-1]]), np.concatenate([commands[1:], commands[-1:]])
    means = commands + np.maximum(late[:-1], 0.0) * (before - commands)
    return np.asarray(means + np.maximum(-late[1:], 0.0) * (after - commands))
