"""What columns of a log measured, for questions that need no units: when, and how far the wheels turned."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.io.importers.all_columns import Column
from twbal.io.importers.bunched_stamps import bunches_of
from twbal.io.importers.column_choice import choose, unit_of
from twbal.io.importers.mapping import UNITS
from twbal.io.importers.mirrored_wheels import run_against_each_other
from twbal.io.importers.time_choice import time_choice
from twbal.io.importers.wraps import angle_wrap, counter_wrap, time_wrap, unwrapped

_GAP = 5.0  # typical steps from which on time has a gap


class WheelPath(NamedTuple):
    """How far the wheels turned.

    Attributes:
        values: (n,) in one unit throughout, whichever it is.
        name: of the columns.
    """

    values: Array
    name: str


def seconds_of(columns: Sequence[Column]) -> Array | None:
    """(n,) time of each row, evened where stamps come in bunches [s]; None where no column says it for certain."""
    time = time_choice(columns)
    if time.split:
        stamps = time.split.values
    elif time.column:
        values = time.column.values
        stamps = UNITS["s"][unit_of("time", time.column).unit] * unwrapped(values, time_wrap(values))
    else:
        return None
    path, tilt = wheel_path(columns), choose("tilt", columns).columns
    angles = {"wheel_angle": path.values} if path else {}
    if tilt:
        angles["tilt"] = straight("tilt", tilt[0])
    bunches = bunches_of(stamps, angles, np.column_stack([column.values for column in columns]))
    return stamps if bunches is None else bunches.times(stamps, bunches.period)


def wheel_path(columns: Sequence[Column]) -> WheelPath | None:
    """What encoders say, as an angle, a distance or a pose; None where a log has none of these for certain."""
    if angle := choose("wheel_angle", columns).columns:
        return WheelPath(_mean(_mended([straight("wheel_angle", column) for column in angle])), names_of(angle))
    if distance := choose("distance", columns).columns:
        ways = [unwrapped(column.values, counter_wrap(column.values)) for column in distance]
        return WheelPath(_mean(_mended(ways)), names_of(distance))
    pose = [choose(name, columns).columns for name in ("x", "y", "heading")]
    if not all(pose):
        return None
    x, y = (each[0].values for each in pose[:2])
    heading = UNITS["rad"][unit_of("heading", pose[2][0]).unit] * straight("heading", pose[2][0])
    middle = 0.5 * (heading[1:] + heading[:-1])
    steps = np.diff(x) * np.cos(middle) + np.diff(y) * np.sin(middle)
    return WheelPath(np.concatenate([[0.0], np.cumsum(steps)]), names_of([pose[0][0], pose[1][0]]))


def straight(quantity: str, column: Column) -> Array:
    """(n,) an angle without jumps at the end of its range, in its own unit."""
    return unwrapped(column.values, angle_wrap(column.values, unit_of(quantity, column).unit))


def _mended(ways: Sequence[Array]) -> Sequence[Array]:
    """What encoders say, both forward where one of two counts backward."""
    if len(ways) == 2 and run_against_each_other(*ways):
        return ways[0], -ways[1]
    return ways


def _mean(values: Sequence[Array]) -> Array:
    mean: Array = np.mean(values, axis=0)
    return mean


def names_of(columns: Sequence[Column]) -> str:
    """Names of columns, or their numbers where they have none."""
    names = [column.name or column.source for column in columns]
    is_numbered = not any(column.name for column in columns)
    return f"{'column' if len(names) == 1 else 'columns'} " * is_numbered + " and ".join(names)


def longest_part(signals: Sequence[Array], time: Array | None) -> slice:
    """The longest run of rows in which all signals are numbers, and time has no gap."""
    there = np.all([np.isfinite(values) for values in signals], axis=0)
    if time is not None:
        there &= np.isfinite(time)
    cuts = np.zeros(len(there), dtype=bool)  # between the row before and this one
    if time is not None and len(time) > 1:
        steps = np.diff(time)
        typical = np.nanmedian(steps)
        cuts[1:] = ~((steps > 0.0) & (steps < _GAP * typical))
    ends = np.flatnonzero(np.concatenate([[True], (~there | cuts)[1:], [True]]))
    longest = int(np.argmax(np.diff(ends))) if len(ends) > 1 else 0
    first, last = int(ends[longest]), int(ends[longest + 1])
    return slice(first + (not there[first]), last)
