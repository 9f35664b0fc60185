"""Which column of a log is its time, or which two: whole seconds, and the fraction of a second beside them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.io.importers.all_columns import Column
from twbal.io.importers.column_choice import choose, grows, is_even
from twbal.io.importers.mapping import UNITS

_DIGITS = {  # of a second's fraction that is counted in a unit, by the unit's forms
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), 0),
    **dict.fromkeys(("ms", "msec", "msecs", "millis", "millisec", "millisecs", "millisecond", "milliseconds"), 3),
    **dict.fromkeys(("us", "µs", "usec", "usecs", "micros", "microsec", "microsecs", "microsecond", "microseconds"), 6),
    **dict.fromkeys(("ns", "nsec", "nsecs", "nanos", "nanosec", "nanosecs", "nanosecond", "nanoseconds"), 9),
}
_PREFIXES = {"milli", "micro", "nano"}  # parted from `sec` where names are written as `stampNanoSec`


class SplitTime(NamedTuple):
    """A time in two columns, as ROS (`sec`, `nanosec`) and the clocks of Linux (`tv_sec`, `tv_usec`) write it.

    Attributes:
        seconds: whole ones.
        fraction: of a second, from 0 on.
        digits: of a second that the fraction counts: 9 for nanoseconds.
    """

    seconds: Column
    fraction: Column
    digits: int

    @property
    def name(self) -> str:
        """The names of both columns."""
        return f"{self.seconds.name} with {self.fraction.name}"

    @property
    def scale(self) -> str:
        """The scales of both columns in a mapping, which takes the mean of two: twice the size of each [s]."""
        return f"[2, 2.0e-{self.digits}]"  # with a point, as without one it is no number in yaml

    @property
    def values(self) -> Array:
        """(n,) time [s]."""
        return self.seconds.values + 10.0**-self.digits * self.fraction.values


class TimeChoice(NamedTuple):
    """The time of a log.

    Attributes:
        column: that it is; None where it is in two columns, or not certain.
        split: both columns of a time in two; None where it is in one, or not certain.
        reason: why it is not certain.
    """

    column: Column | None = None
    split: SplitTime | None = None
    reason: str = ""


def time_choice(columns: Sequence[Column]) -> TimeChoice:
    """The time of a log, by names and numbers."""
    pairs = split_times(columns)
    in_pairs = {column.source for pair in pairs for column in (pair.seconds, pair.fraction)}
    others = [column for column in columns if column.source not in in_pairs]
    growing = [column for column in others if grows(column.values)]
    alone = choose("time", growing)
    forward = [pair for pair in pairs if grows(pair.values)]
    if alone.columns and not forward:
        return TimeChoice(column=alone.columns[0])
    if len(forward) == 1 and not (alone.columns or alone.is_for_person):
        return TimeChoice(split=forward[0])
    if forward:
        names = [*(pair.name for pair in forward), *(column.name for column in alone.columns)]
        names += [alone.reason.removesuffix("?")] if alone.is_for_person else []
        return TimeChoice(reason=f"{' or '.join(names)}?")
    named = [(pair.name, pair.values) for pair in pairs]
    named += [(column.name, column.values) for column in choose("time", others).columns]
    for name, values in named:
        if back := int(np.sum(np.diff(values) < 0.0)):
            return TimeChoice(reason=f"{name} runs backwards {back} times: are the rows in order?")
    even = [column.name or f"column {column.source}" for column in growing if is_even(column.values)]
    hint = f"no name says so; {' and '.join(even)} grows by even steps" if even else "not found; or null and a `rate`"
    return TimeChoice(reason=alone.reason or hint)


def split_times(columns: Sequence[Column]) -> list[SplitTime]:
    """All times in two columns: names that differ by the unit alone, whole seconds, and a fraction below a second."""
    told = [(column, part) for column in columns if (part := _part(column)) is not None]
    whole = [(column, stem) for column, (stem, digits) in told if digits == 0 and _is_whole(column.values)]
    return [
        SplitTime(seconds, fraction, digits)
        for seconds, stem in whole
        for fraction, (other, digits) in told
        if digits and other == stem and _is_below(fraction.values, 10.0**digits)
    ]


def _part(column: Column) -> tuple[tuple[str, ...], int] | None:
    """The words of a name without its unit of time, and the digits of a second that it counts; None without one."""
    *stem, last = column.meaning.stem or ("",)
    if last in _DIGITS:
        if _DIGITS[last] == 0 and stem and stem[-1] in _PREFIXES:
            last = f"{stem.pop()}{last}"
        return tuple(stem), _DIGITS[last]
    unit = column.meaning.unit
    return (column.meaning.stem, _DIGITS[unit]) if unit in UNITS["s"] else None


def _is_whole(values: Array) -> bool:
    there = values[np.isfinite(values)]
    return bool(len(there) and (there == np.round(there)).all())


def _is_below(values: Array, most: float) -> bool:
    """Whether values change, and are from 0 on and below `most`."""
    there = values[np.isfinite(values)]
    return bool(len(there) and there.min() >= 0.0 and there.max() < most and np.ptp(there) > 0.0)
