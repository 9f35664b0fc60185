"""The time stamps of a log: its period, its gaps, and what is odd about them."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twbal.core.errors import LogError
from twbal.core.gaussian import Array, Mask
from twbal.core.time_base import LATE, places_of
from twbal.io.importers.bunched_stamps import bunches_of
from twbal.io.importers.columns import Columns

_MOST_BACKWARD = 0.01  # share of the samples at which time may run backwards
_MOST_ODD = 0.05  # share of the samples that may be lost, or over half a period late; a diagnosis refuses more
_EXACT = 1e-6  # share of a period by which steps vary that were worked out and not measured
_CLOCK = 2e-4  # share to which a period that was measured is known at best: so far off are clocks
_LOOSEST = 5e-3  # and at worst
_FAR = 5  # periods from which on a step is a gap and no jitter
_DIGITS = 12  # of a period or a rate that are tried
_EVEN = 0.25  # share of a step by which even ones differ at most
_SORT = "In order of time its rows are evenly apart: were they swapped? Sort the file by that column."
_OTHER = "Is another column the time, or is its unit wrong?"
FILLED = "filled"
"""Name of the column that is 1 where a sample was missing, and 0 elsewhere."""


class Period(NamedTuple):
    """The time between samples.

    Attributes:
        mean: [s].
        doubt: by which the mean may be off, as stamps jitter or are rounded [s].
    """

    mean: float
    doubt: float

    def of(self, samples: int, wanted: float | None = None) -> float:
        """Time of so many samples [s]: the plainest period or rate within the doubt, so that 70 Hz stay 1/70 s.

        Args:
            samples: in a row.
            wanted: what it is to be, which is taken where that is about as much [s].
        """
        mean, doubt = samples * self.mean, samples * self.doubt
        if wanted is not None and abs(wanted - mean) <= _LOOSEST * mean:
            return wanted
        for digits in range(1, _DIGITS + 1):
            for plain in (float(f"{mean:.{digits}g}"), 1.0 / float(f"{1.0 / mean:.{digits}g}")):
                if abs(plain - mean) <= doubt:
                    return plain
        return mean


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


def stretches(path: Path, signals: Mapping[str, Array], columns: Columns, fill: int) -> SampledParts:
    """Cut a log at its gaps, after bunched stamps were evened, repeated rows left out and short gaps filled.

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
    signals, notes = _without_bunches(signals, columns)
    time, doubts = signals["time"], []
    steps = np.diff(time)
    if not len(steps) or not (steps > 0).any():
        raise LogError(f"{path} has no two samples between which time runs forward; its {len(time)} rows are no log.")
    typical = float(np.median(steps[steps > 0]))
    repeated = np.concatenate([[False], steps == 0])
    if repeated.any():
        notes.append(_repeats(columns, repeated))
    kept = np.flatnonzero(~repeated)
    time = time[kept]
    steps = np.diff(time)
    lines = columns.lines[kept]
    _check_forward(path, time, typical, lines, columns.row)
    missing = np.round(steps / typical).astype(int) - 1
    cuts = np.flatnonzero((steps < 0) | (missing > fill))
    for cut in cuts[:3]:
        why = "time runs backwards" if steps[cut] < 0 else f"{missing[cut]} samples are missing"
        notes.append(f"{why} before {columns.row} {lines[cut + 1]}: a new recording begins there")
    if len(cuts) > 3:
        notes.append(f"and so in {len(cuts) - 3} more places")
    filled = int(missing[(missing > 0) & (missing <= fill)].sum())
    are_few = filled <= _MOST_ODD * (len(time) + filled)
    if filled:
        what = "are left out, as a diagnosis does not count them" if are_few else "are interpolated, as they are many"
        notes.append(f"{filled} missing samples {what}")
    period = _period(steps, typical)
    rows = [kept[part] for part in np.split(np.arange(len(kept)), cuts + 1)]
    late = np.concatenate([places_of(signals["time"][part], period.mean).late for part in rows])
    odd = float(np.mean(np.abs(late) > LATE * period.mean))
    if odd > 0.01:
        note = f"{odd:.1%} of the samples are more than half a period of {period.mean:.6g} s off where they belong"
        if odd > _MOST_ODD:
            doubts.append(f"{note}, and diagnose takes {_MOST_ODD:.0%} at most. {_evenly(steps, typical)}")
        else:
            notes.append(note)
    parts = [_filled({name: values[part] for name, values in signals.items()}, typical, are_few) for part in rows]
    return SampledParts(parts, period, notes, doubts)


def _without_bunches(signals: Mapping[str, Array], columns: Columns) -> tuple[Mapping[str, Array], list[str]]:
    """Signals at the times of an even loop, where stamps come in bunches; and a sentence on it."""
    stamps = signals["time"]
    found = bunches_of(stamps, signals, columns.values)
    if found is None:
        return signals, []
    period = Period(found.period, _known_to(found.doubt, found.period)).of(1)
    note = (
        f"time stamps come in bunches of about {found.rows:.2g} rows, as packets do: each row is put where an even "
        f"loop of {period:.6g} s took it (bunches arrive ±{1e3 * found.late:.2g} ms early or late)"
    )
    return {**signals, "time": found.times(stamps, period)}, [note]


def _known_to(doubt: float, mean: float) -> float:
    """By which a mean step that stamps tell may be off, no less than clocks are [s]."""
    return float(np.clip(doubt, _CLOCK * mean, _LOOSEST * mean))


def _repeats(columns: Columns, repeated: Mask) -> str:
    """A note on rows whose time is that of the row before, (n,)."""
    same = bool((columns.values[1:][repeated[1:]] == columns.values[:-1][repeated[1:]]).all())
    count = int(repeated.sum())
    told, repeat, are = ("1 row", "repeats", "is") if count == 1 else (f"{count} rows", "repeat", "are")
    what = f"that {repeat} the one before" if same else "whose time is that of the one before"
    return f"{told} {what} {are} left out, the first in {columns.row} {columns.lines[np.argmax(repeated)]}"


def _check_forward(path: Path, time: Array, typical: float, lines: NDArray[np.int64], row: str) -> None:
    """Check that time runs backwards hardly ever.

    Args:
        path: of the log.
        time: without repeated rows (n,).
        typical: step [s].
        lines: of the rows in the file (n,).
        row: what a row is called.

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
            + (_SORT if _is_out_of_order(time) else _evenly(steps, typical) if jitters else _OTHER)
        )


def _is_out_of_order(time: Array) -> bool:
    """Whether stamps are evenly apart once they are sorted, so that the rows were swapped."""
    steps = np.diff(np.sort(time))
    return bool(np.mean(np.abs(steps - np.median(steps)) < _EVEN * np.median(steps)) > 1.0 - _MOST_BACKWARD)


def _evenly(steps: Array, typical: float) -> str:
    """What to do where only the stamps are at fault."""
    mean = float(steps[np.abs(steps) < _FAR * typical].mean())
    return (
        "Were the samples taken evenly, and do their stamps jitter? Then leave the stamps out: "
        f"++import.quantities.time=null import.rate={1.0 / Period(mean, _LOOSEST * mean).of(1):.6g}"
    )


def _period(steps: Array, typical: float) -> Period:
    """Mean step where no sample is missing, and twice its standard error."""
    single = steps[np.round(steps / typical) == 1]
    mean, spread = float(single.mean()), float(single.std())
    if spread < _EXACT * mean:
        return Period(mean, 1e-3 * _EXACT * mean)
    return Period(mean, _known_to(2.0 * spread / np.sqrt(len(single)), mean))


def _filled(signals: Mapping[str, Array], period: float, is_marked: bool) -> dict[str, Array]:
    """Signals with missing samples interpolated, and `FILLED` where it is to be told which."""
    time = signals["time"]
    counts = np.maximum(np.round(np.diff(time) / period).astype(int), 1)
    if not len(counts) or counts.max() == 1:
        return dict(signals)
    at: NDArray[np.float64] = np.concatenate([[0.0], np.cumsum(np.repeat(1.0 / counts, counts))])
    found = {name: np.interp(at, np.arange(len(time)), values) for name, values in signals.items()}
    return found | {FILLED: (np.abs(at - np.round(at)) > 1e-6).astype(float)} if is_marked else found
