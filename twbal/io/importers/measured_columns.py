"""What columns of a log measured, for questions that need no units: when, and how far the wheels turned."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.io.importers.all_columns import Column
from twbal.io.importers.bunched_stamps import bunches_of
from twbal.io.importers.column_choice import choose, grows, unit_of
from twbal.io.importers.mapping import UNITS
from twbal.io.importers.wraps import angle_wrap, time_wrap, unwrapped

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
    time = choose("time", [column for column in columns if grows(column.values)]).columns
    if not time:
        return None
    factor = UNITS["s"][unit_of("time", time[0]).unit]
    stamps = factor * unwrapped(time[0].values, time_wrap(time[0].values))
    path, tilt = wheel_path(columns), choose("tilt", columns).columns
    angles = {"wheel_angle": path.values} if path else {}
    if tilt:
        angles["tilt"] = tilt[0].values
    bunches = bunches_of(stamps, angles, np.column_stack([column.values for column in columns]))
    return stamps if bunches is None else bunches.times(stamps, bunches.period)


def wheel_path(columns: Sequence[Column]) -> WheelPath | None:
    """What encoders say, as an angle, a distance or a pose; None where a log has none of these for certain."""
    if angle := choose("wheel_angle", columns).columns:
        unit = unit_of("wheel_angle", angle[0]).unit
        return WheelPath(_mean([unwrapped(c.values, angle_wrap(c.values, unit)) for c in angle]), names_of(angle))
    if distance := choose("distance", columns).columns:
        return WheelPath(_mean([column.values for column in distance]), names_of(distance))
    pose = [choose(name, columns).columns for name in ("x", "y", "heading")]
    if not all(pose):
        return None
    x, y, heading = (each[0].values for each in pose)
    middle = 0.5 * (heading[1:] + heading[:-1])
    steps = np.diff(x) * np.cos(middle) + np.diff(y) * np.sin(middle)
    return WheelPath(np.concatenate([[0.0], np.cumsum(steps)]), names_of([pose[0][0], pose[1][0]]))


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
