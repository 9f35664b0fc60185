"""How a robot's owner writes a log: units, signs, columns, rows, time; and the mapping that reads it right."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.import_checks.robot import Ride
from twbal.core.gaussian import Array
from twbal.core.motor import Motor
from twbal.io.importers.mapping import Mapping as LogMapping
from twbal.io.importers.mapping import mapping

_ANGLES = {"rad": 1.0, "deg": 180 / pi}
_RATES = {"rad/s": 1.0, "deg/s": 180 / pi, "rpm": 30 / pi}
_TIMES = {"s": (1.0, 5), "ms": (1e3, 1), "us": (1e6, 0)}


@dataclass(frozen=True)
class Written:
    """A log and its mapping.

    Attributes:
        columns: by name, (n,) each, as they are written.
        quantities: as the group `import` says them.
        rate: where there is no time [Hz].
        motor: where the command is a voltage.
        comes_before: whether a row's command acted before its sample.
        truth: how the columns come about, for the table.
    """

    columns: Mapping[str, Array]
    quantities: Mapping[str, Mapping[str, Any]]
    rate: float | None
    motor: Motor | None
    comes_before: bool

    @property
    def mapping(self) -> LogMapping:
        """For the import."""
        told = {name: dict(source) for name, source in self.quantities.items()}
        return mapping(told, [], self.rate, False, self.comes_before, 0.0, 3, motor=self.motor)

    def changed(self, quantity: str, **source: Any) -> "Written":
        """With another source of a quantity."""
        return replace(self, quantities={**self.quantities, quantity: {**self.quantities[quantity], **source}})

    def write(self, path: Path) -> None:
        """As a text with a header."""
        lines = [",".join(self.columns)]
        lines += [",".join(f"{value:.10g}" for value in row) for row in np.column_stack(list(self.columns.values()))]
        path.write_text("\n".join(lines) + "\n")


def written(ride: Ride, rng: np.random.Generator) -> Written:
    """A ride in a convention that is drawn."""
    columns: dict[str, Array] = {}
    quantities: dict[str, dict[str, Any]] = {}

    def put(quantity: str, values: Mapping[str, Array], units: Mapping[str, float], digits: int) -> None:
        unit = str(rng.choice(list(units)))
        sign = float(rng.choice([1.0, 1.0, -1.0]))
        for name, column in values.items():
            columns[name] = np.round(sign * units[unit] * column, digits)
        names = list(values)
        quantities[quantity] = {"from": names if len(names) > 1 else names[0], "unit": unit, "scale": sign}

    rate = _write_time(ride, rng, columns, quantities)
    put("tilt", {"angle_y": ride.tilt}, _ANGLES, 4)
    columns["angle_x"] = np.round(ride.roll, 4)
    if rng.random() < 0.8:
        put("tilt_rate", {"gyro_y": ride.tilt_rate}, {"rad/s": 1.0, "deg/s": 180 / pi}, 4)
    columns["gyro_x"] = np.round(ride.roll_rate, 4)
    if rng.random() < 0.7:
        put("yaw_rate", {"gyro_z": ride.yaw_rate}, {"rad/s": 1.0, "deg/s": 180 / pi}, 4)
    sides = {"left": ride.wheels[:, 0], "right": ride.wheels[:, 1]}
    if rng.random() < 0.7:
        put("wheel_angle", {f"wheel_{side}": values for side, values in sides.items()}, _ANGLES, 4)
    else:
        put("wheel_angle", {"wheels": ride.wheels.mean(axis=1)}, _ANGLES, 4)
    if rng.random() < 0.6:
        put("wheel_rate", {"wheel_speed": ride.wheel_rates.mean(axis=1)}, _RATES, 4)
    motor, comes_before = _write_command(ride, rng, columns, quantities)
    columns["speed_asked"] = np.round(ride.reference, 3)
    columns["battery"] = np.round(ride.battery, 2)
    return Written(columns, quantities, rate, motor, comes_before)


def _write_time(
    ride: Ride, rng: np.random.Generator, columns: dict[str, Array], quantities: dict[str, dict[str, Any]]
) -> float | None:
    dt = ride.build.true.control_period
    if rng.random() < 0.2:
        return 1.0 / dt
    unit = str(rng.choice(list(_TIMES)))
    size, digits = _TIMES[unit]
    jitter = float(rng.choice([0.0, 0.02, 0.05])) * dt
    stamps = dt * np.arange(len(ride.tilt)) + jitter * rng.uniform(0.0, 1.0, len(ride.tilt)) + rng.uniform(0, 100)
    columns["stamp"] = np.round(size * stamps, digits)
    quantities["time"] = {"from": "stamp", "unit": unit}
    return None


def _write_command(
    ride: Ride, rng: np.random.Generator, columns: dict[str, Array], quantities: dict[str, dict[str, Any]]
) -> tuple[Motor | None, bool]:
    """One torque, two torques, or two duty cycles; each with the measurements that it answers, or a row later."""
    comes_before = bool(rng.random() < 0.3)
    commands = np.roll(ride.commands, 1, axis=0) if comes_before else ride.commands
    commands = np.where(np.arange(len(commands))[:, None] == 0, 0.0, commands) if comes_before else commands
    kind, sign = rng.choice(["sum", "two", "duty"]), float(rng.choice([1.0, -1.0]))
    if kind == "sum":
        unit = str(rng.choice(["N·m", "mNm"]))
        size = {"N·m": 1.0, "mNm": 1e3}[unit]
        columns["drive"] = sign * size * np.round(commands.sum(axis=1), 5)
        quantities["command"] = {"from": "drive", "unit": unit, "scale": sign}
        return None, comes_before
    names = ["drive_left", "drive_right"]
    if kind == "two":
        for name, column in zip(names, commands.T, strict=True):
            columns[name] = sign * np.round(column, 5)
        quantities["command"] = {"from": names, "unit": "N·m", "scale": 2.0 * sign}
        return None, comes_before
    motor = Motor(2.0, 0.02, ride.build.true.torque_limit / (0.02 * 12.0 / 2.0), 12.0)
    for name, column in zip(names, commands.T, strict=True):
        columns[name] = sign * np.round(100 * 2 * column / ride.build.true.torque_limit, 1)
    quantities["voltage"] = {"from": names, "unit": "%", "scale": sign}
    return motor, comes_before
