"""Single time stamps that are damaged: far from those of the rows before and after, which go on as if it were not."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array, Mask
from twbal.core.text import counted
from twbal.io.importers.bunched_stamps import mean_step
from twbal.io.importers.columns import Columns

_FAR = 5  # mean steps by which a damaged stamp is off at least; no jitter is that large both to and fro
_BACK = 0.1  # of that, by which the rows around it may be apart where stamps come in bunches
_APART = 10  # spans of all other rows by which the first or the last stamp is off at least, so that it is damaged
_FEWEST = 8  # rows, below which nothing is said
_MOST = 0.01  # share of the rows above which it is no single stamps that are damaged


class Mended(NamedTuple):
    """A log whose damaged stamps are replaced.

    Attributes:
        signals: quantities by name, (n,) each.
        damaged: whose stamp was (n,): these rows are to be left out in the end.
        notes: a sentence on them, or none.
    """

    signals: Mapping[str, Array]
    damaged: Mask
    notes: list[str]


def mended(signals: Mapping[str, Array], columns: Columns) -> Mended:
    """The log with stamps in place of damaged ones that are between those around them, so that no row is missing.

    Args:
        signals: quantities by name, (n,) each, `time` among them [s].
        columns: that they were made from.
    """
    stamps = signals["time"]
    damaged = damaged_stamps(stamps)
    if not damaged.any():
        return Mended(signals, damaged, [])
    good, first = np.flatnonzero(~damaged), int(np.argmax(damaged))
    between = np.interp(np.arange(len(stamps)), good, stamps[good])
    are = "is" if damaged.sum() == 1 else "are"
    note = (
        f"{counted(int(damaged.sum()), 'row')} with a time stamp far from those before and after {are} left out, the "
        f"first in {columns.row} {columns.lines[first]} ({stamps[first]:.6g} s)"
    )
    return Mended({**signals, "time": between}, damaged, [note])


def damaged_stamps(stamps: Array) -> Mask:
    """The rows whose stamp alone is damaged, (n,); all False where that would be more than a few.

    Args:
        stamps: of all rows (n,), finite [s].
    """
    damaged = np.zeros(len(stamps), bool)
    if len(stamps) < _FEWEST:
        return damaged
    far = _FAR * abs(mean_step(stamps))
    steps = np.diff(stamps)
    to, fro = steps[:-1], steps[1:]
    off = np.minimum(np.abs(to), np.abs(fro))
    around = stamps[2:] - stamps[:-2]
    goes_on = (around >= 0.0) & (around <= np.maximum(far, _BACK * off))
    damaged[1:-1] = (np.sign(to) == -np.sign(fro)) & (off > far) & goes_on
    inner = stamps[1:-1][~damaged[1:-1]]
    reach = max(_APART * float(np.ptp(inner)), far)
    damaged[0] = abs(stamps[0] - inner[0]) > reach
    damaged[-1] = abs(stamps[-1] - inner[-1]) > reach
    return damaged if damaged.sum() <= max(1.0, _MOST * len(stamps)) else np.zeros(len(stamps), bool)
