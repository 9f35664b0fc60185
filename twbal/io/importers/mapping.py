"""What the columns of a foreign log mean."""

from collections.abc import Mapping as Mappings
from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np

from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array
from twbal.core.motor import Motor
from twbal.io.importers.columns import Columns, Name
from twbal.io.importers.wraps import about_zero, unwrapped

QUANTITIES = {
    "time": "s",
    "tilt": "rad",  # of the body, forward positive
    "tilt_rate": "rad/s",  # by a gyro
    "accelerometer_forward": "m/s²",  # forward and up in the body: gravity up where the robot stands
    "accelerometer_up": "m/s²",
    "acceleration": "m/s²",  # of the platform, forward
    "yaw_rate": "rad/s",
    "wheel_angle": "rad",  # of the wheels relative to the body: what encoders count
    "wheel_rate": "rad/s",
    "distance": "m",  # wheel radius times wheel_angle
    "x": "m",  # x, y and heading: the pose by dead reckoning, whose path is `distance`
    "y": "m",
    "heading": "rad",
    "command": "N·m",  # torque of both wheels together
    "voltage": "V",  # of both motors as one, in place of a torque
}
"""All that a mapping can tell, with its unit."""

ACCELEROMETER = "accelerometer_forward", "accelerometer_up"
"""Quantities whose direction is that of gravity, where the robot does not speed up."""

UNITS = {
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9},
    "rad": {"rad": 1.0, "deg": pi / 180, "°": pi / 180, "turn": 2 * pi},
    "rad/s": {"rad/s": 1.0, "deg/s": pi / 180, "°/s": pi / 180, "dps": pi / 180, "rpm": pi / 30, "turn/s": 2 * pi},
    "m/s²": {"m/s²": 1.0, "m/s2": 1.0, "g": 9.80665, "mg": 9.80665e-3},
    "m": {"m": 1.0, "cm": 1e-2, "mm": 1e-3},
    "N·m": {"N·m": 1.0, "Nm": 1.0, "N m": 1.0, "mNm": 1e-3, "mN·m": 1e-3, "mN m": 1e-3, "Ncm": 1e-2},
    "V": {"V": 1.0, "mV": 1e-3},
}
"""Units that a column may have, by the SI unit, with their size in it."""

PERCENT = "%"
"""Unit of a duty cycle in place of a voltage: percent of the motor's supply."""

SIDES = ("left", "right")
"""Of which wheel the first and the second of two columns are."""

_KEYS = ("from", "unit", "scale", "offset", "wraps")


@dataclass(frozen=True)
class QuantitySource:
    """Where a quantity comes from: the mean over its columns of scale · unit · column, + offset.

    A column that wraps is unwrapped before: it jumps back where it reaches the end of its range. From one sample to the
    next it must change by less than half of that.

    Attributes:
        columns: whose mean is taken; two of them are of the left and of the right wheel.
        factors: SI units for one of each column's, with the sign.
        offset: added afterwards, in SI units.
        wraps: range after which the columns jump back, in their own numbers; None: they do not.
        is_duty: whether they are duty cycles in percent of the motor's supply.
    """

    columns: tuple[Name, ...]
    factors: tuple[float, ...]
    offset: float
    wraps: float | None = None
    is_duty: bool = False

    def signal(self, values: Array) -> Array:
        """(n, m) columns in SI units, of (n, m) columns as they are written."""
        if self.wraps is not None:
            values = np.column_stack([unwrapped(column, self.wraps) for column in values.T])
        si_values: Array = values * np.array(self.factors) + self.offset
        return si_values


@dataclass(frozen=True)
class Mapping:
    """How a kind of log is read.

    Attributes:
        quantities: sources by name, of `QUANTITIES`.
        names: of all columns, where files have no header; may be empty.
        rate: samples a second, for logs without time [Hz]; None takes the column `time`.
        motor: that turns voltage into torque; None where the command is a torque.
        command_is_sample: the command column is an instant of a loop that runs faster than the log.
        command_before_sample: a row's command acted before the row's sample, not after it.
        skip: what is left out at the beginning of each recording [s].
        fill: missing samples in a row within a recording; a longer gap parts it.

    Raises:
        ConfigError: what it says cannot be.
    """

    quantities: Mappings[str, QuantitySource]
    names: tuple[str, ...]
    rate: float | None
    motor: Motor | None
    command_is_sample: bool
    command_before_sample: bool
    skip: float
    fill: int

    def __post_init__(self) -> None:
        have = set(self.quantities)
        if not have & {"tilt", "tilt_rate"}:
            raise ConfigError("A mapping needs a source of `tilt`, or of the `tilt_rate` that it is worked out from.")
        if len(have & set(ACCELEROMETER)) == 1:
            raise ConfigError(f"A mapping needs both of {' and '.join(ACCELEROMETER)}, or none of them.")
        if not have & {"wheel_angle", "wheel_rate", "distance"} and not {"x", "y", "heading"} <= have:
            raise ConfigError(
                "A mapping needs what the wheels did: `wheel_angle`, `wheel_rate`, `distance`, or `x`, `y`, `heading`."
            )
        if ("command" in have) == ("voltage" in have):
            raise ConfigError("A mapping needs either a `command` (torque) or a `voltage`, and not both.")
        if "voltage" in have and self.motor is None:
            raise ConfigError("A mapping with a `voltage` needs the `motor` that turns it into a torque.")
        if ("time" in have) == (self.rate is not None):
            raise ConfigError("A mapping needs either a source of `time` or a `rate` [Hz], and not both.")
        if self.rate is not None and not self.rate > 0:
            raise ConfigError(f"The rate of a mapping must be positive; found {self.rate} Hz.")
        if self.command_is_sample and self.command_before_sample:
            raise ConfigError("A command that is a sample acts around it: leave command_before_sample=false.")
        if self.skip < 0 or self.fill < 0:
            raise ConfigError(f"skip and fill of a mapping must be 0 or more; found {self.skip} and {self.fill}.")

    @property
    def measures_tilt(self) -> bool:
        """Whether sensors tell the tilt: a column of it, or a gyro with an accelerometer."""
        return "tilt" in self.quantities or ACCELEROMETER[0] in self.quantities

    @property
    def wanted(self) -> list[Name]:
        """The columns of all sources, in order."""
        return [column for source in self.quantities.values() for column in source.columns]

    @property
    def unsaid(self) -> frozenset[str]:
        """Quantities whose column has their own name, as in the mapping `columns`, from which others take the rest."""
        return frozenset(
            name for name, source in self.quantities.items() if source == QuantitySource((name,), (1.0,), 0.0)
        )

    def signals(self, columns: Columns) -> dict[str, Array]:
        """The quantities in SI units, (n,) each, from the columns that `wanted` names.

        Those of two columns come a second and a third time, one column each: `left wheel_angle`, `right wheel_angle`.
        A tilt that wraps is within half a turn of 0 in the median, whichever turn it begins in.
        """
        found, first = {}, 0
        for name, source in self.quantities.items():
            last = first + len(source.columns)
            values = source.signal(columns.values[:, first:last])
            if name == "tilt" and source.wraps is not None and len(values):
                values = about_zero(values, source.wraps * abs(source.factors[0]))
            found[name] = values.mean(axis=1)
            if len(source.columns) == len(SIDES):
                found |= {f"{side} {name}": column for side, column in zip(SIDES, values.T, strict=True)}
            first = last
        return found


def mapping(
    quantities: Mappings[str, Any],
    names: list[str],
    rate: float | None,
    command_is_sample: bool,
    command_before_sample: bool,
    skip: float,
    fill: int,
    *,
    motor: Motor | None = None,
) -> Mapping:
    """A mapping as the group `import` says it: as `Mapping`, and sources with from, unit, scale, offset, wraps.

    Raises:
        ConfigError: what it says cannot be.
    """
    unknown = sorted(set(quantities) - set(QUANTITIES))
    if unknown:
        raise ConfigError(f"A log has no quantity {unknown[0]!r}; a mapping can tell: {', '.join(QUANTITIES)}.")
    supply = motor.supply if motor else None
    sources = {name: _source(name, entry, supply) for name, entry in quantities.items() if entry is not None}
    return Mapping(sources, tuple(names), rate, motor, command_is_sample, command_before_sample, skip, fill)


def _source(name: str, entry: Any, supply: float | None) -> QuantitySource:
    """One source, checked. A voltage may be a duty cycle: percent of the motor's supply."""
    entry = dict(entry) if isinstance(entry, Mappings) else {"from": entry}
    odd = sorted(set(entry) - set(_KEYS))
    if odd or "from" not in entry:
        needed = "" if "from" in entry else f" It needs `from`: write {name}: {{from: <column>, ...}}."
        raise ConfigError(
            f"The source of {name} has the keys {', '.join(_KEYS)}; found {', '.join(map(str, entry))}.{needed}"
        )
    unit = entry.get("unit", QUANTITIES[name])
    known = dict(UNITS[QUANTITIES[name]])
    if name == "voltage" and supply is not None:
        known[PERCENT] = supply / 100
    elif name == "voltage" and unit == PERCENT:
        raise ConfigError(
            "A voltage in % needs a motor (supply, resistance, torque_constant, gear): fill in `motor`, or map the "
            "duty cycle to `command` and write voltage: null (docs/import.md)."
        )
    if unit not in known:
        raise ConfigError(f"{name} cannot be in {unit!r}; it can be in: {', '.join(known)}.")
    columns = entry["from"] if isinstance(entry["from"], list | tuple) else [entry["from"]]
    scale = entry.get("scale", 1.0)
    try:
        offset = float(entry.get("offset", 0.0))
        scales = [float(each) for each in scale] if isinstance(scale, list | tuple) else [float(scale)] * len(columns)
    except (TypeError, ValueError) as error:
        found = f"{scale} and {entry.get('offset', 0.0)}"
        raise ConfigError(f"The scale and the offset of {name} are to be numbers; found {found}.") from error
    if len(scales) != len(columns):
        raise ConfigError(
            f"The source of {name} has {len(scales)} scales for {len(columns)} columns; give one for all, or one each."
        )
    if not columns or not np.isfinite([*scales, offset]).all() or 0.0 in scales:
        raise ConfigError(f"The source of {name} needs columns, a scale that is not 0, and a finite offset.")
    wraps = None if entry.get("wraps") is None else float(entry["wraps"])
    if wraps is not None and not (np.isfinite(wraps) and wraps > 0.0):
        raise ConfigError(f"`wraps` of {name} is the range after which a column jumps back; found {wraps}.")
    factors = tuple(each * known[unit] for each in scales)
    return QuantitySource(tuple(columns), factors, offset, wraps, unit == PERCENT)
