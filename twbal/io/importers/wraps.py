"""Columns that jump back at the end of their range: counters of 16 and 32 bits, angles of one turn."""

import numpy as np

from twbal.core.gaussian import Array

_COUNTERS = 2.0**16, 2.0**32
_OF_TIME = 20.0  # ordinary steps that one over a wrap is at most
_FULL = 0.97  # share of its range that a column that wraps goes through at least
_SMALL = 0.25  # of the range, above which a step between two jumps may be a jump, too


def time_wrap(values: Array) -> float | None:
    """The range of a time that runs backwards by just that, again and again; None of any other column."""
    values = values[np.isfinite(values)]
    steps = np.diff(values)
    if not (steps < 0.0).any() or not (steps > 0.0).any():
        return None
    ordinary = float(np.median(steps[steps > 0.0]))
    back = steps[steps < 0.0]
    for wrap in _COUNTERS:
        if values.min() >= 0.0 and values.max() < wrap and (back + wrap > 0.0).all():
            return wrap if (back + wrap <= _OF_TIME * ordinary).all() else None
    return None


def angle_wrap(values: Array, unit: str) -> float | None:
    """The range of a column of angles or counts that jumps by about that; None where none does.

    Args:
        values: of the column.
        unit: of it, of `UNITS["rad"]`.
    """
    turn = turn_of(unit)
    return counter_wrap(values) or (turn if wraps_round(values, turn) else None)


def turn_of(unit: str) -> float:
    """One turn in a unit of `UNITS["rad"]`."""
    return {"deg": 360.0, "°": 360.0, "turn": 1.0}.get(unit, 2.0 * np.pi)


def counter_wrap(values: Array) -> float | None:
    """The range of a counter of 16 or 32 bits that jumps by about that, as one does that is below 0 and has no sign.

    None where none does, or the numbers are not whole.
    """
    there = values[np.isfinite(values)]
    if (there != np.round(there)).any():
        return None
    return next((wrap for wrap in _COUNTERS if wraps_round(there, wrap)), None)


def wraps_round(values: Array, wrap: float) -> bool:
    """Whether a column goes through a whole range, and jumps at its end."""
    values = values[np.isfinite(values)]
    if len(values) < 2:
        return False
    jumps = np.abs(np.diff(values)) > 0.5 * wrap
    is_full = _FULL * wrap <= np.ptp(values) <= wrap
    return bool(is_full and jumps.any() and np.abs(np.diff(np.unwrap(values, period=wrap))).max() < _SMALL * wrap)


def unwrapped(values: Array, wrap: float | None) -> Array:
    """(n,) values without jumps by `wrap`, None: as they are; what is missing stays so."""
    if wrap is None:
        return values
    there = np.isfinite(values)
    straight = values.copy()
    straight[there] = np.unwrap(values[there], period=wrap)
    return straight


def about_zero(values: Array, turn: float) -> Array:
    """(n, m) columns, each shifted by as many whole turns as bring its median nearest to 0; `turn` is in their unit."""
    shifted: Array = values - turn * np.round(np.nanmedian(values, axis=0) / turn)
    return shifted
