"""Time stamps in bunches, as of rows that a computer received in packets: back to when an even loop took them.

A packet is stamped when it arrives, after its last row was taken. So that row is where its packet's stamp is, but for
how late the packet came, and the rows before it are one period of the loop earlier each. The period is the slope of
arrivals over rows. A lost packet moves all arrivals after it; one that is late moves none but its own. The first and
the last bunch of a recording may be cut: a clock of whole seconds stamps the last rows before a second is full.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twbal.core.gaussian import Array, Mask

_WINDOW = 200  # rows over which the mean step is taken; their median is not that of pauses
_SHORT = 0.3  # mean steps below which a step is within a bunch
_MANY = 1 / 3  # of the steps that are so short, from which stamps come in bunches, and are not late now and then
_FEWEST = 10  # bunches, and changes of an angle, by which that is judged
_BACKWARD = 0.01  # share of the steps at which time may run backwards
_EVENLY = 0.5  # of what an angle changes over a long step, from which it changes over short ones as an even loop's does
_LAG = 50  # bunches from which to which a first period is taken
_NEAR = 16  # bunches, the earliest of which is on time
_LOST = 0.5  # of the rows of a bunch, from which on a shift of all later arrivals is a loss; or of one row
_ROUNDS = 6  # of numbering rows by the period, and taking the period from the numbers
_FAR = 20  # typical times between bunches from which on a recording ends, and numbers begin anew
_USUAL = 0.1, 0.9  # quantiles of the rows of bunches between which those of the first and the last bunch are typical
ANGLES = "wheel_angle", "distance", "tilt"
"""Quantities that change smoothly, and tell how much time there was between two rows."""


class Bunches(NamedTuple):
    """What bunched stamps tell of an even loop.

    Attributes:
        numbers: of the period in which each row was taken (n,), from 0 on in each part; lost rows have one, too.
        parts: indices at which time was set back or went far ahead, and the numbers begin anew.
        last: (b,) indices of the last row of each bunch.
        period: mean step [s].
        doubt: twice its standard error [s].
        rows: of a bunch, in the mean.
        late: standard deviation of when bunches arrive [s]; the first and last of each part count where they are whole.
    """

    numbers: NDArray[np.int64]
    parts: NDArray[np.int64]
    last: NDArray[np.int64]
    period: float
    doubt: float
    rows: float
    late: float

    def times(self, stamps: Array, period: float) -> Array:
        """Instants of all rows, each part from its first stamp on, at a period of about the mean step (n,) [s]."""
        begins = np.concatenate([[0], self.parts])
        origins = np.repeat(stamps[begins], np.diff(np.append(begins, len(stamps))))
        return np.asarray(origins + period * self.numbers)


def mean_step(stamps: Array) -> float:
    """Step in the mean over windows of rows, of which the median is taken, so that pauses do not count [s].

    Args:
        stamps: (n,), two at least [s].
    """
    window = max(min(_WINDOW, (len(stamps) - 1) // 4), 1)
    return float(np.median(stamps[window:] - stamps[:-window]) / window)


def bunches_of(stamps: Array, signals: Mapping[str, Array], rows: Array) -> Bunches | None:
    """The bunches of a log; None where its stamps do not come in bunches.

    They do where a third of the steps are far shorter than the mean, while all angles that move change by as much over
    these as over the others: a loop that is as uneven as its stamps is none. Nor are rows that are written twice.

    Args:
        stamps: of all rows (n,) [s].
        signals: quantities by name, (n,) each.
        rows: (n, m) as they were written.
    """
    steps = np.diff(stamps)
    if len(steps) < 4 * _FEWEST or np.mean(steps < 0.0) > _BACKWARD:
        return None
    short = (steps >= 0.0) & (steps < _SHORT * mean_step(stamps))
    again = (steps == 0.0) & (rows[1:] == rows[:-1]).all(axis=1)
    if short.mean() < _MANY or again.sum() > 0.5 * short.sum() or (~short).sum() < _FEWEST:
        return None
    if not _is_even(short, steps, signals):
        return None
    far = steps > _FAR * np.median(steps[~short])
    return _numbered(stamps, np.flatnonzero(np.append(~short, True)), np.flatnonzero((steps < 0.0) | far) + 1)


def _is_even(short: Mask, steps: Array, signals: Mapping[str, Array]) -> bool:
    """Whether all angles that move change over the short steps as they do over the others that are no pauses.

    A noisy angle does so in an uneven loop, too; one that is clean does not.
    """
    usual = ~short & (steps >= 0.0) & (steps < 2.0 * np.median(steps[~short]))
    changes = [np.nan_to_num(np.abs(np.diff(signals[name]))) for name in ANGLES if name in signals]
    moving = [each for each in changes if np.count_nonzero(each) >= _FEWEST]
    return all(bool(each[short].mean() >= _EVENLY * each[usual].mean()) for each in moving)


def _numbered(stamps: Array, last: NDArray[np.int64], parts: NDArray[np.int64]) -> Bunches:
    """The bunches, of which `last` are the last rows."""
    arrivals, counts = stamps[last], np.diff(last, prepend=-1)
    part_of = np.searchsorted(parts, last, side="right")
    lines = _whole(counts, part_of)
    whole = np.concatenate(lines)
    lag = min(_LAG, max(map(len, lines)) // 2)  # of the longest part
    together = part_of[whole[lag:]] == part_of[whole[:-lag]]
    period = float(np.median((_ahead(arrivals[whole], lag) / _ahead(last[whole], lag))[together]))
    lost = np.zeros(len(last), np.int64)
    for _ in range(_ROUNDS):
        for line in lines:
            lost[line] = _lost(arrivals[line] / period - last[line], float(np.median(counts)))
        numbers = last + lost
        off = [(numbers[line] - numbers[line].mean(), arrivals[line] - arrivals[line].mean()) for line in lines]
        x, y = (np.concatenate(each) for each in zip(*off, strict=True))
        period = float(x @ y / (x @ x))
    late = float(np.std(y - period * x))
    for line in lines:  # a cut bunch at the end goes on from the one before
        after = line[-1] + 1
        if after < len(last) and part_of[after] == part_of[line[-1]]:
            numbers[after] = last[after] + lost[line[-1]]
    of_rows = np.repeat(numbers, counts) - (np.repeat(last, counts) - np.arange(len(stamps)))
    begins = np.concatenate([[0], parts])
    of_rows -= np.repeat(of_rows[begins], np.diff(np.append(begins, len(stamps))))
    return Bunches(of_rows, parts, last, period, 2.0 * late / float(np.sqrt(x @ x)), float(counts.mean()), late)


def _ahead(values: Array | NDArray[np.int64], lag: int) -> Array:
    """By how much values are more so many places further on, (n - lag,)."""
    return np.asarray(values[lag:] - values[:-lag], float)


def _whole(counts: NDArray[np.int64], part_of: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """The bunches of each part that has any; its first and its last only where they have typically many rows.

    Args:
        counts: rows of each bunch (b,).
        part_of: number of the part that it is in (b,).
    """
    new = part_of[1:] != part_of[:-1]
    inner = ~(np.append(True, new) | np.append(new, True))
    usable = np.ones(len(counts), bool)
    if inner.any():
        least, most = np.quantile(counts[inner], _USUAL)
        usable = inner | ((counts >= least) & (counts <= most))
    lines = [np.flatnonzero((part_of == k) & usable) for k in range(int(part_of[-1]) + 1)]
    if max(map(len, lines)) < 2:
        lines = [np.flatnonzero(part_of == k) for k in range(int(part_of[-1]) + 1)]
    return [line for line in lines if len(line)]


def _lost(behind: Array, rows: float) -> NDArray[np.int64]:
    """Rows that were lost before each bunch, all together, by how far arrivals are behind (n,) [rows].

    The earliest of those to come is on time. Where it is later still from the next bunch on, this one was late, and the
    loss comes after it. At the end too few are left to tell a loss from bunches that are late.
    """
    on_time = np.array([behind[k : k + _NEAR].min() for k in range(len(behind))])
    least = max(_LOST * rows, 1.0)
    lost = np.zeros(len(behind), np.int64)
    for k in range(1, len(behind)):
        lost[k] = lost[k - 1]
        before = float((behind[max(k - _NEAR, 0) : k] - lost[max(k - _NEAR, 0) : k]).min())
        shift = on_time[k] - lost[k] - before
        if k + _NEAR // 2 <= len(behind) and shift > least and not _LOST < on_time[k + 1] - on_time[k] < least:
            lost[k] += round(shift)
    return lost
