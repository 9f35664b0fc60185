"""Logs whose stamps are in bunches or coarse, with their rows at the times at which an even loop took them."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twbal.core.gaussian import Array
from twbal.core.text import counted
from twbal.io.importers.bunched_stamps import Bunches, bunches_of
from twbal.io.importers.coarse_stamps import coarse_of
from twbal.io.importers.columns import Columns
from twbal.io.importers.rate_changes import RateChange, rate_changes
from twbal.io.importers.stamp_period import measured_period

_ROWS = 50  # rows of one rate in a row, from which on it is no slow phase of a loop
_BUNCHES = 25  # bunches of one rate in a row
_SAID = 3  # changes of the rate that are told one by one
_LATE = 3.0  # periods by which bunches may be early or late (standard deviation)
_AGREE = 0.01  # share of the period to which rows that are close together and all rows tell the same
_KNOWN = 2e-3  # share of the period within which it must be known: over 500 rows it is off by one then


class Evened(NamedTuple):
    """A log whose time is that of an even loop where its stamps are not.

    Attributes:
        signals: quantities by name, (n,) each.
        notes: what was done.
        doubts: what looks wrong.
        changes: sentences on rows at which the rate changes, which are no part of the doubts.
    """

    signals: Mapping[str, Array]
    notes: list[str]
    doubts: list[str]
    changes: list[str]


def evened(signals: Mapping[str, Array], columns: Columns) -> Evened:
    """The log at the times of an even loop, where stamps come in bunches or are coarse; else as it is.

    Args:
        signals: quantities by name, (n,) each, `time` among them [s].
        columns: that they were made from.
    """
    stamps = signals["time"]
    bunches = bunches_of(stamps, signals, columns.values)
    if bunches is not None:
        return _of_bunches(signals, columns, bunches)
    steps = np.diff(stamps)
    again = (steps == 0.0) & (columns.values[1:] == columns.values[:-1]).all(axis=1)
    is_twice = again.sum() > 0.5 * (steps == 0.0).sum()  # rows that are written twice are no samples
    kept = np.flatnonzero(np.append(True, steps != 0.0) if is_twice else np.ones(len(stamps), bool))
    if changes := _told(rate_changes(np.diff(stamps[kept]), _ROWS), kept, columns):
        return Evened(signals, [], [], changes)
    coarse = coarse_of(stamps[kept], {name: values[kept] for name, values in signals.items()})
    if coarse is None:
        return Evened(signals, [], [], [])
    period = measured_period(coarse.period, coarse.doubt).of(1)
    note = (
        f"time stamps have ticks of about {coarse.tick:.3g} s, and angles turn as far over short steps as over long "
        f"ones: each row is put where an even loop of {period:.6g} s took it"
    )
    times = coarse.times(stamps[kept], period)
    of_all = np.repeat(times, np.diff(np.append(kept, len(stamps))))  # also of rows that are written twice
    doubts = []
    if abs(coarse.nearby - coarse.period) > _AGREE * coarse.period:
        doubts.append(
            f"rows were lost that time stamps with ticks of about {coarse.tick:.3g} s do not tell: the period is "
            f"{coarse.nearby:.4g} s by rows that are close together, and {coarse.period:.4g} s by all. Log finer stamps"
        )
    return Evened({**signals, "time": of_all}, [note], doubts, [])


def _of_bunches(signals: Mapping[str, Array], columns: Columns, found: Bunches) -> Evened:
    """The log at the times of an even loop, where stamps come in bunches."""
    stamps = signals["time"]
    period = measured_period(found.period, found.doubt).of(1)
    note = (
        f"time stamps come in bunches of about {found.rows:.2g} rows, as packets do: each row is put where an even "
        f"loop of {period:.6g} s took it (bunches arrive ±{round(1e3 * found.late, 6):.2g} ms early or late)"
    )
    steps = np.diff(stamps[found.last]) / np.diff(found.last)
    changes = _told(rate_changes(steps, _BUNCHES), found.last, columns)
    doubts: list[str] = []
    if changes:
        return Evened({**signals, "time": found.times(stamps, period)}, [note], doubts, changes)
    if found.late > _LATE * found.period:
        doubts.append(
            f"bunches of time stamps arrive ±{found.late:.2g} s early or late, which is more than {_LATE:g} periods of "
            f"{period:.6g} s: lost rows, and a loop that is not even, cannot be told from that"
        )
    if found.doubt > _KNOWN * found.period:
        doubts.append(f"stamps in bunches tell the period of {period:.6g} s to {found.doubt / found.period:.1%} only")
    if doubts:
        doubts[-1] += (
            ". If you know the rate of the loop and no row was lost, give that rate in place of the stamps: "
            "++import.quantities.time=null import.rate=... [Hz]"
        )
    return Evened({**signals, "time": found.times(stamps, period)}, [note], doubts, [])


def _told(changes: Sequence[RateChange], rows: NDArray[np.int64], columns: Columns) -> list[str]:
    """Sentences on changes of the rate.

    Args:
        changes: of steps between some rows.
        rows: which rows these are (k,).
        columns: whose rows they are.
    """
    said = [
        f"the rate changes at {columns.row} {columns.lines[rows[each.row]]} from {each.before:.4g} to "
        f"{each.after:.4g} s: cut the file there"
        for each in changes[:_SAID]
    ]
    more = len(changes) - _SAID
    return said + [f"the rate changes in {counted(more, 'more place')}: cut the file there, too"] * (more > 0)
