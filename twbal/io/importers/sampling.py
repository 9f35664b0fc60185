"""The time stamps of a log: its period, its gaps, and what is odd about them."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twbal.core.errors import LogError
from twbal.core.gaussian import Array, Mask
from twbal.core.text import counted
from twbal.core.time_base import LATE, places_of
from twbal.io.importers.coarse_stamps import FAR, are_even
from twbal.io.importers.columns import Columns
from twbal.io.importers.damaged_stamps import mended
from twbal.io.importers.even_stamps import evened
from twbal.io.importers.stamp_period import Period, even_rate, period_of

_MOST_BACKWARD = 0.01  # share of the samples at which time may run backwards
_MOST_ODD = 0.05  # share of the samples that may be lost, or over half a period late; a diagnosis refuses more
_LONG = 1.25  # periods of a step, below which no row was lost in it, though the clock may have fallen behind by one
_TWICE = 2.5  # median steps, up to which angles are asked whether a row was lost in one
_COUNTED = 1e6  # missing samples of a gap that are counted; of a longer one its time is told
_EVEN = 0.25  # share of a step by which even ones differ at most
_SORT = "In order of time its rows are evenly apart: were they swapped? Sort the file by that column."
_OTHER = "Is another column the time, or is its unit wrong?"
FILLED = "filled"
"""Name of the column that is 1 where a sample was missing, and 0 elsewhere."""


class SampledParts(NamedTuple):
    """The parts of a log between its gaps.

    Attributes:
        parts: quantities by name, (n,) each, and `FILLED` where missing samples are to be left out again.
        period: between samples.
        notes: what was done.
        doubts: what looks wrong.
    """

    parts: list[dict[str, Array]]
    period: Period
    notes: list[str]
    doubts: list[str]


class _Rows(NamedTuple):
    """Where the rows of one part lie on an even time base.

    Attributes:
        at: numbers of the rows in the log (n,).
        counts: periods from each row to the next (n - 1,), at least 1: more where samples are missing.
        late: by which each row is after its instant (n,) [s].
    """

    at: NDArray[np.int64]
    counts: NDArray[np.int64]
    late: Array


def stretches(path: Path, signals: Mapping[str, Array], columns: Columns, fill: int) -> SampledParts:
    """Cut a log at its gaps, after bunched and coarse stamps were evened, repeated rows left out, short gaps filled.

    What was filled serves checks and filters. A diagnosis does better without it, as it knows how robots move; but it
    takes no log in which many samples are missing.

    Args:
        path: of the log, for errors.
        signals: quantities by name, `time` among them [s].
        columns: that they were made from.
        fill: missing samples in a row up to which a recording goes on.

    Raises:
        LogError: time does not run forward.
    """
    if not (np.diff(signals["time"]) > 0).any():
        count = len(signals["time"])
        raise LogError(f"{path} has no two samples between which time runs forward; its {count} rows are no log.")
    signals, damaged, notes = mended(signals, columns)
    signals, more, doubts, changes = evened(signals, columns)
    signals, columns = _without(damaged, signals, columns)
    notes, doubts = [*notes, *more], [*doubts, *changes]
    repeated = np.append(False, np.diff(signals["time"]) == 0)
    if repeated.any():
        notes.append(_repeats(columns, repeated))
    kept = np.flatnonzero(~repeated)
    time, lines = signals["time"][kept], columns.lines[kept]
    steps = np.diff(time)
    typical = float(np.median(steps[steps > 0]))
    advice = "" if changes else _evenly(steps, typical)
    told = ". ".join(each[:1].upper() + each[1:] for each in changes)
    _check_forward(path, time, typical, lines, columns.row, told or advice)
    missing = np.round(steps / typical) - 1.0
    cuts = np.flatnonzero((steps < 0) | (missing > fill))
    notes += _cuts_told(cuts, steps, missing, lines, columns.row)
    period = period_of(steps, typical)
    rows = [_rows(at, signals["time"], period.mean) for at in np.split(kept, cuts + 1)]
    filled = sum(int((part.counts - 1).sum()) for part in rows)
    are_few = filled <= _MOST_ODD * (len(time) + filled)
    if filled:
        notes.append(_filled_told(filled, are_few))
    if not (are_few or changes):
        doubts += _lost_or_coarse(signals, columns, kept, rows, advice)
    late = np.concatenate([part.late for part in rows])
    odd = float(np.mean(np.abs(late) > LATE * period.mean))
    if odd > 0.01:
        note = f"{odd:.1%} of the samples are more than half a period of {period.mean:.6g} s off where they belong"
        if odd > _MOST_ODD:
            doubts.append(f"{note}, and diagnose takes {_MOST_ODD:.0%} at most. {advice}".strip())
        else:
            notes.append(note)
    parts = [
        _filled({name: values[part.at] for name, values in signals.items()}, part.counts, are_few) for part in rows
    ]
    return SampledParts(parts, period, notes, doubts)


def _without(rows: Mask, signals: Mapping[str, Array], columns: Columns) -> tuple[Mapping[str, Array], Columns]:
    """The log without some of its rows, (n,)."""
    if not rows.any():
        return signals, columns
    kept = columns._replace(values=columns.values[~rows], lines=columns.lines[~rows], rows=columns.rows[~rows])
    return {name: values[~rows] for name, values in signals.items()}, kept


def _rows(at: NDArray[np.int64], time: Array, period: float) -> _Rows:
    """Where rows of one part lie: one was lost only in a step that is long, and if those after it do not catch up."""
    numbers, late = places_of(time[at], period)
    return _Rows(at, np.where(np.diff(time[at]) < _LONG * period, 1, np.diff(numbers)), late)


def _repeats(columns: Columns, repeated: Mask) -> str:
    """A note on rows whose time is that of the row before, (n,)."""
    same = bool((columns.values[1:][repeated[1:]] == columns.values[:-1][repeated[1:]]).all())
    count = int(repeated.sum())
    told, repeat, are = ("1 row", "repeats", "is") if count == 1 else (f"{count} rows", "repeat", "are")
    what = f"that {repeat} the one before" if same else "whose time is that of the one before"
    return f"{told} {what} {are} left out, the first in {columns.row} {columns.lines[np.argmax(repeated)]}"


def _cuts_told(cuts: NDArray[np.int64], steps: Array, missing: Array, lines: NDArray[np.int64], row: str) -> list[str]:
    """Notes on where new recordings begin.

    Args:
        cuts: steps after which they do (k,).
        steps: between stamps (n - 1,) [s].
        missing: samples in each step (n - 1,).
        lines: of the rows in the file (n,).
        row: what a row is called.
    """
    notes = []
    for cut in cuts[:3]:
        lost = (
            f"{missing[cut]:.0f} samples are missing" if missing[cut] < _COUNTED else f"{steps[cut]:.3g} s are missing"
        )
        why = "time runs backwards" if steps[cut] < 0 else lost
        notes.append(f"{why} before {row} {lines[cut + 1]}: a new recording begins there")
    return notes + [f"and so in {len(cuts) - 3} more places"] * (len(cuts) > 3)


def _filled_told(filled: int, are_few: bool) -> str:
    """A note on samples that are missing."""
    if not are_few:
        return f"{filled} missing samples are interpolated, as they are many"
    is_left, them = ("is left", "it") if filled == 1 else ("are left", "them")
    return f"{counted(filled, 'missing sample')} {is_left} out, as a diagnosis does not count {them}"


def _lost_or_coarse(
    signals: Mapping[str, Array], columns: Columns, kept: NDArray[np.int64], rows: Sequence[_Rows], advice: str
) -> list[str]:
    """A doubt about many missing samples, unless angles tell that rows were lost, or this import left them out.

    Args:
        signals: quantities by name, (n,) each.
        columns: that they were made from.
        kept: rows that are used (m,).
        rows: the same in parts.
        advice: what to do where no row was lost.
    """
    left_out = np.diff(columns.rows, prepend=columns.rows[0] - 1) - 1  # before each row
    unknown = sum(int(np.maximum(part.counts - 1 - left_out[part.at[1:]], 0).sum()) for part in rows)
    share = unknown / (len(kept) + unknown)
    steps = np.diff(signals["time"][kept])
    kept_signals = {name: values[kept] for name, values in signals.items()}
    even = are_even(steps, kept_signals, _TWICE * float(np.median(steps)))
    if share <= _MOST_ODD or even is False:
        return []
    why = (
        "angles turn no farther over these steps than over others, so that no row seems to be lost"
        if even
        else "angles do not tell whether rows were lost, or the stamps alone are late or coarse"
    )
    return [f"{share:.0%} of the samples are missing by the time stamps, and were interpolated: {why}. {advice}"]


def _check_forward(path: Path, time: Array, typical: float, lines: NDArray[np.int64], row: str, advice: str) -> None:
    """Check that time runs backwards hardly ever.

    Args:
        path: of the log.
        time: without repeated rows (n,).
        typical: step [s].
        lines: of the rows in the file (n,).
        row: what a row is called.
        advice: what to do where stamps jitter.

    Raises:
        LogError: it does so more often.
    """
    steps = np.diff(time)
    back = np.flatnonzero(steps < 0)
    if len(back) > max(1, _MOST_BACKWARD * len(steps)):
        first = back[0]
        jitters = float(np.median(-steps[back])) < 2 * typical
        raise LogError(
            f"In {path} time runs backwards {len(back)} times, first in {row} {lines[first + 1]} "
            f"({time[first]:g} s, then {time[first + 1]:g} s). "
            + (_SORT if _is_out_of_order(time) else advice if jitters else _OTHER)
        )


def _is_out_of_order(time: Array) -> bool:
    """Whether stamps are evenly apart once they are sorted, so that the rows were swapped."""
    steps = np.diff(np.sort(time))
    return bool(np.mean(np.abs(steps - np.median(steps)) < _EVEN * np.median(steps)) > 1.0 - _MOST_BACKWARD)


def _evenly(steps: Array, typical: float) -> str:
    """What to do where only the stamps are at fault."""
    return (
        "Were the samples taken evenly, and do their stamps jitter? Then leave the stamps out: "
        f"++import.quantities.time=null import.rate={even_rate(steps, FAR * typical):.6g}"
    )


def _filled(signals: Mapping[str, Array], counts: NDArray[np.int64], is_marked: bool) -> dict[str, Array]:
    """Signals with missing samples interpolated, and `FILLED` where it is to be told which.

    Args:
        signals: quantities by name, (n,) each.
        counts: periods from each row to the next (n - 1,).
        is_marked: whether to tell which samples were missing.
    """
    if not len(counts) or counts.max() == 1:
        return dict(signals)
    at: NDArray[np.float64] = np.concatenate([[0.0], np.cumsum(np.repeat(1.0 / counts, counts))])
    rows = np.arange(len(counts) + 1)
    found = {name: np.interp(at, rows, values) for name, values in signals.items()}
    return found | {FILLED: (np.abs(at - np.round(at)) > 1e-6).astype(float)} if is_marked else found
