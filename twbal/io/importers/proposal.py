"""Lines of a mapping while it is put together: each quantity with its columns, its unit, and what is open of it."""

from collections.abc import Sequence

import numpy as np

from twbal.io.importers.all_columns import Column
from twbal.io.importers.column_choice import Unit, counts, unit_of
from twbal.io.importers.duty_torque import FullDuty
from twbal.io.importers.mapping import QUANTITIES, UNITS
from twbal.io.importers.mirrored_wheels import run_against_each_other
from twbal.io.importers.wraps import angle_wrap, counter_wrap, time_wrap, unwrapped

OPEN = "'???'"
"""What a person has to fill in; in quotes, without which it is no yaml within braces."""

_QUARTER = 0.5 * np.pi  # rad; IMUs are mounted at multiples of it


class Proposal:
    """Lines of a mapping while it is put together."""

    def __init__(self) -> None:
        self.lines: dict[str, str] = {}
        self.columns: dict[str, Sequence[Column]] = {}
        self.open: list[str] = []
        self.unknown_units: list[str] = []
        self.motor = False
        self.duty: tuple[str, FullDuty] | None = None

    def take(
        self, quantity: str, columns: Sequence[Column], scale: str = "", why: str = "", by_others: Unit | None = None
    ) -> None:
        """Take columns for a quantity, in the unit that others tell, or that they have by themselves."""
        unit, said, is_assumed, is_scaled = by_others or unit_of(quantity, columns[0])
        if not is_scaled:
            scale = OPEN
            self.open.append(f"scale of {quantity}")
        elif said and counts(quantity, columns[0]) and not scale:
            scale, said = OPEN, f"whole numbers: fill in the scale, {QUANTITIES[quantity]} for one"
            self.open.append(f"scale of {quantity}")
        elif is_assumed and scale == OPEN:
            said = ""
        elif is_assumed:
            self.unknown_units.append(quantity)
        wrap = _wrap_of(quantity, columns, unit)
        if _are_mirrored(quantity, columns, wrap):
            last = columns[-1].name or f"column {columns[-1].source}"
            advice = "write [s, -s] in the place of a scale s" if scale else "hence the two scales"
            scale, said = (
                scale or "[1, -1]",
                "; ".join(text for text in (said, f"{last} counts backward: {advice}") if text),
            )
        scaled = f", scale: {scale}" if scale else ""
        if wrap:
            scaled += f", wraps: {wrap:.10g}"
            said = "; ".join(text for text in (said, "it begins anew at the end of its range") if text)
            if quantity == "tilt" and (origin := _origin(columns[0], wrap, unit)):
                scaled += f", offset: {-origin:.6g}"
                said += f", and is counted from {np.degrees(origin):.0f}° of upright, hence the offset"
        comment = "; ".join(text for text in (why, said) if text)
        names = " and ".join(column.name or "without a name" for column in columns)
        text = f"{names}{': ' if comment else ''}{comment}"
        self.lines[quantity] = f"{{from: {sources_of(columns)}, unit: {unit}{scaled}}}  # {text}"
        self.columns[quantity] = columns

    def leave(self, quantity: str, reason: str) -> None:
        """Leave a quantity for a person to fill in."""
        self.lines[quantity] = f"{{from: {OPEN}, unit: {QUANTITIES[quantity]}}}  # {reason}"
        self.open.append(f"{quantity} ({reason})")

    def drop(self, quantity: str, reason: str = "") -> None:
        """Say that a log does not have a quantity."""
        self.lines[quantity] = f"null{'  # ' if reason else ''}{reason}"


def sources_of(columns: Sequence[Column]) -> str:
    """One column or several, as `from` of a mapping names them."""
    sources = ", ".join(column.source for column in columns)
    return f"[{sources}]" if len(columns) > 1 else sources


def _wrap_of(quantity: str, columns: Sequence[Column], unit: str) -> float | None:
    """The range after which columns jump back; None where they do not."""
    if quantity == "time":
        return time_wrap(columns[0].values)
    if quantity == "distance":
        found = (counter_wrap(column.values) for column in columns)
    elif quantity in ("wheel_angle", "tilt", "heading"):
        found = (angle_wrap(column.values, unit) for column in columns)
    else:
        return None
    return next((wrap for wrap in found if wrap), None)


def _origin(column: Column, wrap: float, unit: str) -> float:
    """Which quarter turn a tilt that wraps is at in the middle, from -90° to 180°; 0 of one that is upright [rad]."""
    middle = UNITS["rad"][unit] * float(np.nanmedian(unwrapped(column.values, wrap)))
    quarters = int(np.round(middle / _QUARTER)) % 4
    return _QUARTER * (quarters if quarters < 3 else -1)


def _are_mirrored(quantity: str, columns: Sequence[Column], wrap: float | None) -> bool:
    """Whether columns are of two wheels, one of which counts backward."""
    if len(columns) != 2 or quantity not in ("wheel_angle", "distance", "wheel_rate"):
        return False
    ways = [unwrapped(column.values, wrap) for column in columns]
    left, right = (np.nancumsum(way) for way in ways) if quantity == "wheel_rate" else ways
    return run_against_each_other(left, right)
