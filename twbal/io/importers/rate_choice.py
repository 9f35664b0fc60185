"""Rates of a log by the changes of their angles: which axis of a gyro, and in which unit, where names do not say it."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.io.importers.all_columns import Column
from twbal.io.importers.column_choice import ColumnChoice, Unit, choose, counts, unit_of
from twbal.io.importers.mapping import QUANTITIES, UNITS
from twbal.io.importers.measured_columns import seconds_of, straight

_ANGLES = {"tilt_rate": "tilt", "wheel_rate": "wheel_angle"}
_OFF = {"tilt": 1.5, "wheel_angle": 1.1}
"""Times by which a rate and the changes of its angle may differ: a tilt is filtered, and its gyro is of few per cent; a
speed in cm/s may look like one in rpm."""
_OF_GYRO = "tilt_rate", "yaw_rate"
_AXES = {"x", "y", "z"}
_UNLIKE = 0.4  # correlation with the tilt's changes, below which an axis of a gyro is another one
_RAW = 50.0  # largest of a gyro's whole numbers, from which on they are no rad/s
_WINDOW = 0.25  # s; over which a rate is summed, so that the noise of the angle is small beside its change
_ALIKE = 0.8  # correlation of sums and changes, from which on they are of one motion


class _Turned(NamedTuple):
    """An angle over time: [s], [rad]; whether its unit is assumed; what it is called; whether it needs no scale."""

    time: Array
    angle: Array
    is_assumed: bool
    name: str
    is_scaled: bool


def rate_choice(rate: str, columns: Sequence[Column]) -> tuple[ColumnChoice, str]:
    """The columns of a rate, and how they were told where their names are not enough: gyro_x or gyro_y?"""
    choice = choose(rate, columns)
    angle = _angle_of(rate, columns)
    if rate != "tilt_rate" or not choice.is_for_person or angle is None:
        return choice, ""
    axes = [c for c in columns if c.meaning.quantity == rate and c.meaning.certain and np.isfinite(c.values).any()]
    sums = [_sums_of(angle.time, angle.angle, column.values) for column in axes]
    best = max(range(len(axes)), key=lambda k: abs(sums[k].correlation))
    others = [abs(each.correlation) for k, each in enumerate(sums) if k != best]
    if not sums[best].are_alike or max(others, default=0.0) > _UNLIKE:
        return choice, ""
    return ColumnChoice([axes[best]]), f"of {' and '.join(c.name for c in axes)} the one that {angle.name} changes by"


def unit_by_angle(rate: str, columns: Sequence[Column], others: Sequence[Column]) -> Unit | None:
    """The unit of a rate by the changes of its angle; None where its name says it, or they do not."""
    angle = _angle_of(rate, others)
    if columns[0].meaning.unit:
        return None
    if rate == "tilt_rate" and angle is not None and not angle.is_scaled:
        return _by_scale_of(angle, columns[0])
    if rate in _OF_GYRO and (angle is None or rate == "tilt_rate") and is_raw(columns[0]):
        return _raw(angle, columns[0])
    if angle is None:
        return None
    name = _ANGLES[rate]
    if angle.is_assumed and name == "wheel_angle":
        return None
    values = np.mean([each.values for each in columns], axis=0)
    sums = _sums_of(angle.time, angle.angle, values)
    found = _rate_unit(sums, _OFF[name])
    if angle.is_assumed and found == QUANTITIES[rate]:  # both may be in degrees
        return None
    return Unit(found, f"unit by the changes of {angle.name}") if found else None


def is_raw(column: Column) -> bool:
    """Whether a gyro's numbers are counts of its converter, or whole degrees a second."""
    values = column.values[np.isfinite(column.values)]
    return bool((values == np.round(values)).all() and np.abs(values).max(initial=0.0) > _RAW)


def are_alike(one: Column, other: Column) -> bool:
    """Whether two columns are axes of one gyro whose names tell no unit: `gyro_y` and `gyro_z`."""
    return not other.meaning.unit and set(one.meaning.stem) - _AXES == set(other.meaning.stem) - _AXES


def _by_scale_of(angle: _Turned, rate: Column) -> Unit | None:
    """The unit of a gyro whose angle is to be scaled: its scale is a multiple of that one; None where none is seen."""
    sums = _sums_of(angle.time, angle.angle, rate.values)
    if not sums.are_alike:
        return _raw(None, rate) if is_raw(rate) else None
    ratio = np.degrees(sums.size)
    return Unit("deg/s", f"fill in the scale: about {ratio:.2g} × the scale of {angle.name}", is_scaled=False)


def _raw(angle: _Turned | None, rate: Column) -> Unit:
    """The unit of whole numbers: degrees a second, or else counts, of which a data sheet tells the scale."""
    sums = _sums_of(angle.time, angle.angle, rate.values) if angle else None
    size = ""
    if angle and sums and sums.are_alike:
        if _rate_unit(sums, _OFF["tilt"]) in ("deg/s", "°/s", "dps") and not angle.is_assumed:
            return Unit("deg/s", f"unit by the changes of {angle.name}")
        size = f", about {np.degrees(sums.size):.2g} by the changes of {angle.name}"
    why = f"raw numbers: fill in the scale, deg/s for one{size} (an MPU-6050 has 1/131 at ±250 deg/s)"
    return Unit("deg/s", why, is_scaled=False)


def _angle_of(rate: str, columns: Sequence[Column]) -> _Turned | None:
    """The angle that a rate is of, where the log has it and its time; None where it does not, or it counts ticks."""
    name = _ANGLES.get(rate, "")
    angle, seconds = choose(name, columns).columns, seconds_of(columns)
    if not angle or seconds is None or counts(name, angle[0]):
        return None
    unit, _, is_assumed, is_scaled = unit_of(name, angle[0])
    turned = UNITS["rad"][unit] * np.mean([straight(name, each) for each in angle], axis=0)
    return _Turned(seconds, turned, is_assumed, " and ".join(each.name for each in angle), is_scaled)


class _Sums(NamedTuple):
    """A rate summed over time beside the changes of an angle.

    Attributes:
        correlation: of both; 0 where one of them stands still.
        size: of the rate's unit, as they tell it [rad/s].
    """

    correlation: float
    size: float

    @property
    def are_alike(self) -> bool:
        """Whether both are of one motion, with either sign."""
        return abs(self.correlation) >= _ALIKE


def _rate_unit(sums: _Sums, off: float) -> str | None:
    """The unit of a rate; None where its sums are not alike to the changes of its angle, or fit no unit.

    Args:
        sums: of the rate.
        off: times by which their sizes may differ from those of a unit.
    """
    if not sums.are_alike:
        return None
    fitting = {unit: max(sums.size / of_it, of_it / sums.size) for unit, of_it in UNITS["rad/s"].items()}
    best = min(fitting, key=lambda unit: fitting[unit])
    return best if fitting[best] < off else None


def _sums_of(time: Array, angle: Array, rate: Array) -> _Sums:
    """How a rate sums up to the changes of an angle.

    Args:
        time: of each row [s], growing.
        angle: [rad], with either sign.
        rate: in its own unit.
    """
    there = np.isfinite(time) & np.isfinite(angle) & np.isfinite(rate)
    time, angle, rate = time[there], angle[there], rate[there]
    if len(time) < 2 or time[-1] - time[0] < 8.0 * _WINDOW:
        return _Sums(0.0, 1.0)
    summed = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))])
    ends = np.searchsorted(time, np.arange(time[0], time[-1], _WINDOW))
    sums, changes = np.diff(summed[ends]), np.diff(angle[ends])
    sums, changes = sums - sums.mean(), changes - changes.mean()  # without the bias of a gyro
    sizes = float(np.sqrt((sums @ sums) * (changes @ changes)))
    if sizes == 0.0:
        return _Sums(0.0, 1.0)
    return _Sums(float(sums @ changes) / sizes, abs(float(sums @ changes)) / float(sums @ sums))
