"""What the fields of a text say: numbers, times of day, or that something is missing."""

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from twbal.core.gaussian import Array

MISSING = frozenset(
    {"", "-", "--", "nan", "-nan", "na", "n/a", "#n/a", "#na", "<na>", "null", "none", "nil", "1.#qnan", "-1.#ind"}
)
"""What programs write where a number is missing, in small letters."""
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(nan|inf)|0[xX][0-9a-fA-F]+|", re.IGNORECASE)
DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_DATE = r"\d{4}-\d\d-\d\d"
_CLOCK = r"\d\d:\d\d:\d\d(?:[.,]\d{1,9})?"
_TIME = re.compile(rf"(?:({_DATE})[T ])?({_CLOCK})(?:Z|[+-]\d\d:?\d\d| ?UTC)?")


def is_number(field: str, comma: bool) -> bool:
    """Whether a field is empty or a number, one with a decimal comma where there may be some."""
    return bool(NUMBER.fullmatch(field) or (comma and DECIMAL_COMMA.fullmatch(field)))


def is_time(field: str) -> bool:
    """Whether a field is a time of day, with or without its date: `2024-05-03T12:34:56.789Z`, `12:34:56.789`."""
    return bool(_TIME.fullmatch(field))


def seconds_of(fields: Sequence[str]) -> Array | None:
    """(n,) seconds from the first of n times of day, NaN where one is missing; None where a field is something else.

    A zone is not looked at, as it is the same throughout a log.
    """
    plain = [field.strip() for field in fields]
    found = [_TIME.fullmatch(field) for field in plain]
    if not any(found) or any(
        not each and field.lower() not in MISSING for each, field in zip(found, plain, strict=True)
    ):
        return None
    try:
        stamps = np.array(
            [f"{each[1] or '1970-01-01'}T{each[2].replace(',', '.')}" if each else "NaT" for each in found],
            dtype="datetime64[ns]",
        )
    except ValueError:  # a month 13
        return None
    return seconds_since_first(stamps)


def seconds_since_first(stamps: NDArray[np.datetime64]) -> Array:
    """(n,) seconds from the first of n stamps, NaN where one is missing."""
    since = (stamps - stamps[np.argmin(np.isnat(stamps))]).astype("timedelta64[ns]")
    return np.where(np.isnat(since), np.nan, since.astype(np.int64) / 1e9)
