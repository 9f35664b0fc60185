"""Rows that a log has twice: a buffer that was written twice, a file that was joined to itself, each row again."""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from twbal.core.gaussian import Array
from twbal.io.importers.checks.doubt import Curves, Doubt, DoubtKind, LogPart

_CHANCE = 30.0  # bits beyond those of all pairs of rows: one log in 10⁹ repeats so much by chance
_REGULAR = 0.9  # share of the changes that come after the same number of rows, from which rows are held
_FEWEST = 20  # changes by which that is judged


def held_doubts(part: LogPart, every: int) -> Iterator[Doubt]:
    """A sentence on rows that all come several times, of which the import takes more than one: `every` of them."""
    times = rows_held(part.measured)
    if every % times:
        sentence = (
            f"each row comes {times} times in a row: was it written more often than the robot measures? Then give "
            f"period={times * part.period:.3g}. If the log has no time, is its `rate` that of the rows?"
        )
        yield Doubt(DoubtKind.REPEATED, "", sentence, Curves(part.period, part.signals["tilt"], "tilt [rad]"))


def repeat_doubts(part: LogPart) -> Iterator[Doubt]:
    """A sentence on the longest run of rows that comes a second time."""
    found = longest_repeat(part.measured)
    if found is None:
        return
    first, second, count = found
    sentence = (
        f"{count} rows from {first * part.period:.3g} s on come again from {second * part.period:.3g} s on, to the "
        "last digit: was a part written twice? Cut one of them out"
    )
    again = np.full(len(part.signals["tilt"]), np.nan)
    again[first : first + count] = again[second : second + count] = part.signals["tilt"][first : first + count]
    evidence = Curves(part.period, part.signals["tilt"], "tilt [rad]", again, "rows that come twice [rad]")
    yield Doubt(DoubtKind.REPEATED, "", sentence, evidence)


def rows_held(signals: Mapping[str, Array]) -> int:
    """How many times each row comes one after another; 1 where they do not all come as many times."""
    rows = np.column_stack(list(signals.values()))
    gaps = np.diff(np.flatnonzero((np.diff(rows, axis=0) != 0.0).any(axis=1)))
    if len(gaps) < _FEWEST:
        return 1
    times = int(np.median(gaps))
    return times if np.mean(gaps == times) >= _REGULAR else 1


def longest_repeat(signals: Mapping[str, Array]) -> tuple[int, int, int] | None:
    """Where the longest run of equal rows begins, where it comes again, and how long it is.

    Rows that are like the one before do not count, as sensors at rest repeat themselves. A row that changes is worth
    one bit at least, so that a run must have as many as there are bits in the number of pairs of rows, and some more.

    Returns:
        None where no run is longer than chance makes it.
    """
    rows = np.ascontiguousarray(np.column_stack(list(signals.values())))
    keys = np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)
    moved = np.concatenate([[1], (np.diff(keys) != 0).astype(int)])
    worth = np.concatenate([[0], np.cumsum(moved)])
    least = 2.0 * np.log2(len(keys)) + _CHANCE
    begun: dict[tuple[int, ...], int] = {}
    best = (0, 0, 0)
    k, window = 0, 8
    while k + window <= len(keys):
        earlier = begun.setdefault(tuple(keys[k : k + window]), k)
        if earlier < k:
            count = _run(keys, earlier, k)
            if worth[k + count] - worth[k] > least and count > best[2]:
                best = (earlier, k, count)
            k += max(count - window, 1)
        else:
            k += 1
    return best if best[2] else None


def _run(keys: NDArray[np.integer], first: int, second: int) -> int:
    """How many keys in a row are equal from `first` and from `second` on."""
    same = keys[first : first + len(keys) - second] == keys[second:]
    return len(same) if same.all() else int(np.argmin(same))
