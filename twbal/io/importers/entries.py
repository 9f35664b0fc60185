"""Entries of a column that may be numbers, texts of numbers, words for a missing number, or anything else."""

import re
from decimal import Decimal
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twbal.core.errors import printable
from twbal.core.gaussian import Array
from twbal.io.importers.fields import MISSING, is_time, seconds_of

_NUMBER = re.compile(r"[+-]?(?:(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?|nan|inf|infinity)", re.IGNORECASE | re.ASCII)
_ODD = 0.01  # share of the entries of a column of numbers that are none, at most, as in a text
_SHOWN = 40  # characters of an entry in a sentence


class Entries(NamedTuple):
    """A column's entries as numbers.

    Attributes:
        numbers: (n,), NaN where an entry is missing or no number.
        odd: how many entries are neither numbers nor missing.
        place: of the first of these, from 1 on; 0 without one.
        word: the first of these, in quotation marks; "" without one.
    """

    numbers: Array
    odd: int = 0
    place: int = 0
    word: str = ""

    @property
    def is_text(self) -> bool:
        """Whether so many entries are no numbers that the column is none of numbers."""
        return self.odd > _ODD * len(self.numbers)

    def note(self, name: str) -> str:
        """A sentence on the entries of a column of that name that are taken as missing."""
        more = (
            f"and {self.odd - 1} more {'entry that is no number' if self.odd == 2 else 'entries that are no numbers'}"
        )
        which = f"{self.word} in entry {self.place} of {name}"
        return f"{which} {more} are taken as missing" if self.odd > 1 else f"{which} is taken as missing"


def entries_of(items: NDArray[Any]) -> Entries:
    """Entries as numbers, times of day as seconds from the first of them.

    Args:
        items: (n,) of any kind.
    """
    if items.dtype.kind == "S":
        items = np.char.decode(items, "latin-1")
    items = items.astype(object)
    first = next((item for item in items if not _is_missing(item)), None)
    if isinstance(first, str) and is_time(first.strip()):
        seconds = seconds_of(["" if item is None else str(item) for item in items])
        if seconds is not None:
            return Entries(seconds)
    numbers = np.array([_number(item) for item in items], dtype=np.float64)
    odd = [k for k in np.flatnonzero(np.isnan(numbers)) if not _is_missing(items[k])]
    if not odd:
        return Entries(numbers)
    return Entries(numbers, len(odd), int(odd[0]) + 1, repr(printable(str(items[odd[0]]))[:_SHOWN]))


def _is_missing(item: Any) -> bool:
    return item is None or str(item).strip().lower() in MISSING


def _number(item: Any) -> float:
    """An entry as a number; NaN where it is none, such as a hexadecimal text or one with underscores."""
    if isinstance(item, str):
        text = item.strip()
        return float(text) if _NUMBER.fullmatch(text) else np.nan
    if isinstance(item, int):
        try:
            return float(item)
        except OverflowError:  # of 309 digits
            return np.inf if item > 0 else -np.inf
    return float(item) if isinstance(item, float | Decimal | np.floating | np.integer | np.bool_) else np.nan
