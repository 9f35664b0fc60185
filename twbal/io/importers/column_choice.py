"""Which columns of a log are a quantity, and in which unit, by names and numbers."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.io.importers.all_columns import Column
from twbal.io.importers.column_names import COUNTING, FUSED
from twbal.io.importers.column_units import COUNTED
from twbal.io.importers.mapping import QUANTITIES, UNITS
from twbal.io.importers.wraps import time_wrap, turn_of, wraps_round

_LARGEST_TILT = 3.5  # rad; a larger one is in degrees
_TURNED = 360.0, 240.0  # degrees; a tilt that goes beyond, or through more, is not in them
_HALF_TURN, _HANGING = 180.0, 150.0  # degrees; nor is one that goes beyond the former, but is mostly below the latter
_STEPS = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
_PERIODS = (0.0005, 0.3)  # s; of logs
_SAID = {
    "command": "torque of both wheels (a voltage or duty cycle belongs to `voltage`)",
    "wheel_angle": "angle of the wheels",
    "wheel_rate": "rate of the wheels",
}
"""What quantities are called where their names do not say it."""
_OF_WHEELS = ("wheel_angle", "wheel_rate", "distance")  # what an encoder may count
_ROUNDED = 0.01  # share of the largest value by which the same numbers in two units may differ
_WHOLE = 10  # a column of whole numbers that spans more counts something


class ColumnChoice(NamedTuple):
    """Columns of a quantity.

    Attributes:
        columns: one, or a left and a right one; none where that is not certain.
        reason: why there are none.
        is_for_person: whether the log has the quantity, and only a person can say which column it is.
    """

    columns: Sequence[Column] = ()
    reason: str = ""
    is_for_person: bool = False


class Unit(NamedTuple):
    """The unit of a column.

    Attributes:
        unit: of it.
        comment: what is to be said of it.
        is_assumed: whether nothing but habit speaks for it.
        is_scaled: whether its numbers are in it; else they are to be scaled to it.
    """

    unit: str
    comment: str = ""
    is_assumed: bool = False
    is_scaled: bool = True


def choose(quantity: str, columns: Sequence[Column]) -> ColumnChoice:
    """The columns of a quantity."""
    unit = QUANTITIES.get(quantity, "")
    named = [column for column in columns if column.meaning.quantity == quantity]
    meant = [column for column in named if np.isfinite(column.values).any()]
    units = {"", *UNITS.get(unit, ()), *(COUNTED if quantity in _OF_WHEELS else ())}
    fitting = [c for c in meant if c.meaning.unit in units or not unit]
    certain = _plainest(quantity, [column for column in fitting if column.meaning.certain])
    sides = {column.meaning.side for column in certain}
    if len(certain) == 1 and sides == {""}:
        return ColumnChoice(certain)
    if len(certain) == 2 and sides == {"left", "right"} and certain[0].meaning.stem == certain[1].meaning.stem:
        return ColumnChoice(certain)
    if len(certain) == 1:
        return ColumnChoice((), f"{certain[0].name} is of one wheel only: is that enough?", is_for_person=True)
    if certain:
        return ColumnChoice((), f"{' or '.join(_told_apart(certain))}?", is_for_person=True)
    if fitting:
        names = " or ".join(_told_apart(fitting))
        if len(fitting) == 2 and {column.meaning.side for column in fitting} == {"left", "right"}:
            names = f"both {fitting[0].name} and {fitting[1].name}"
        said = _SAID.get(quantity, quantity)
        if _are_numbered(fitting):
            text = f"perhaps {names}: which is of the left wheel? If they are the {said}, "
            return ColumnChoice((), f"{text}fill in both, the left wheel's first, and the unit")
        text = f"perhaps {names}: such a name may mean other things. If it is the {said}, "
        what = "name" if len({column.name for column in fitting}) == len(fitting) else "number"
        return ColumnChoice((), f"{text}fill in its {what} and unit")
    if meant:
        return ColumnChoice((), f"{meant[0].name} is in {meant[0].meaning.unit}: to take it, fill in a scale to {unit}")
    if any(column.meaning.certain for column in named):
        names = " and ".join(column.name for column in named)
        return ColumnChoice((), f"{names}: not all of its fields are numbers")
    return ColumnChoice()


def _told_apart(columns: Sequence[Column]) -> list[str]:
    """The names of columns, with their numbers where several have one name."""
    names = [column.name for column in columns]
    return [c.name if names.count(c.name) == 1 else f"{c.name} (column {c.source})" for c in columns]


def _plainest(quantity: str, certain: list[Column]) -> list[Column]:
    """Columns without those that tell the same as another one, or tell the tilt less well."""
    if quantity == "tilt":
        fused = [column for column in certain if FUSED & set(column.meaning.stem)]
        certain = fused if len(fused) == 1 else certain
    if len(certain) == 2 and not any(column.meaning.side for column in certain) and _are_one(quantity, *certain):
        return [min(certain, key=lambda column: column.meaning.unit != QUANTITIES[quantity])]
    return certain


def _are_one(quantity: str, one: Column, other: Column) -> bool:
    """Whether two columns are the same numbers in two units: `pitch_rad` and `pitch_deg`."""
    sizes = UNITS.get(QUANTITIES.get(quantity, ""), {})
    units = one.meaning.unit, other.meaning.unit
    if one.meaning.stem != other.meaning.stem or units[0] == units[1] or not set(units) <= set(sizes):
        return False
    first, second = sizes[units[0]] * one.values, sizes[units[1]] * other.values
    return bool(np.nanmax(np.abs(first - second)) <= _ROUNDED * np.nanmax(np.abs(first)))


def _are_numbered(columns: Sequence[Column]) -> bool:
    """Whether two columns differ by a number alone, as those of two wheels do: `motor1_pwm` and `motor2_pwm`."""
    stems = [[word for word in column.meaning.stem if not word.isdigit()] for column in columns]
    return len(columns) == 2 and stems[0] == stems[1] and columns[0].meaning.stem != columns[1].meaning.stem


def grows(values: Array) -> bool:
    """Whether values go up from row to row, but for one in a hundred, or for a counter that begins anew."""
    steps = np.diff(values[np.isfinite(values)])
    return bool(len(steps) and steps.max() > 0 and np.mean(steps < 0) <= 0.01) or time_wrap(values) is not None


def is_even(values: Array) -> bool:
    """Whether values change by steps of one size, but for one in twenty."""
    steps = np.diff(values[np.isfinite(values)])
    return bool(np.mean(np.abs(steps - np.median(steps)) < 0.25 * np.median(steps)) > 0.95)


def counts(quantity: str, column: Column) -> bool:
    """Whether a column of what the wheels did is in counts of an encoder."""
    values = column.values[np.isfinite(column.values)]
    is_whole = bool((values == np.round(values)).all()) and bool(np.ptp(values) > _WHOLE)
    is_said = column.meaning.unit in COUNTED or (not column.meaning.unit and bool(COUNTING & set(column.meaning.stem)))
    return quantity in _OF_WHEELS and (is_whole or is_said)


def unit_of(quantity: str, column: Column) -> Unit:
    """The unit that a column's name says, or that its numbers tell; else that of the quantity."""
    stated = column.meaning.unit
    if stated in UNITS[QUANTITIES[quantity]]:
        return Unit(stated)
    largest = float(np.nanmax(np.abs(column.values)))
    if quantity == "time":
        step = float(np.nanmedian(np.diff(column.values)))
        for unit, of_a_second in _STEPS.items():
            if _PERIODS[0] <= step / of_a_second <= _PERIODS[1]:
                return Unit(unit, f"unit by its steps of {step:.6g}")
    for unit in ("deg", "rad") if quantity in ("tilt", "heading") else ():
        if wraps_round(column.values, turn_of(unit)):
            return Unit(unit, f"unit by its jumps of {turn_of(unit):.4g}")
    if quantity == "tilt" and _is_beyond_degrees(column.values):
        said = f"its largest value, {largest:.5g}, is none of a tilt in degrees: fill in the scale"
        return Unit("deg", f"{said}, 0.01 if in hundredths of a degree", is_scaled=False)
    if quantity == "tilt" and largest > _LARGEST_TILT:
        return Unit("deg", f"unit by its largest value, {largest:.3g}")
    unit = QUANTITIES[quantity]
    return Unit(unit, f"UNIT NOT KNOWN, taken as {unit}; the largest value is {largest:.3g}", is_assumed=True)


def _is_beyond_degrees(tilt: Array) -> bool:
    """Whether a tilt that does not wrap is too large for degrees; that of a robot counted from hanging is about 180."""
    sizes = np.abs(tilt[np.isfinite(tilt)])
    largest, through = float(sizes.max(initial=0.0)), float(np.nanmax(tilt) - np.nanmin(tilt))
    is_about_zero = largest > _HALF_TURN and float(np.median(sizes)) < _HANGING
    return largest > _TURNED[0] or through > _TURNED[1] or is_about_zero
