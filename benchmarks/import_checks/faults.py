"""Faults of a log or of its mapping, and what a warning about each must be of."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from benchmarks.import_checks.conventions import Written
from twbal.core.gaussian import Array
from twbal.io.importers.checks.doubt import DoubtKind

_TURN = 1.0  # rad by which the wheels must differ
_WRAPPED = 7.0  # rad over which a wheel must turn to wrap
_RESET = 3.0  # rad from which on it matters that an encoder is set to zero
_SPIKES = {"tilt": (0.5, 3.0), "wheel_angle": (5.0, 50.0)}  # rad by which one sample is off


class Planted(NamedTuple):
    """A log with a fault.

    Attributes:
        log: what is imported.
        what: is wrong with it.
    """

    log: Written
    what: str


class Fault(NamedTuple):
    """One kind of fault.

    Attributes:
        plant: makes it; None where a log has nothing that could be so.
        kinds: of doubts that name it.
    """

    plant: Callable[[Written, np.random.Generator], Planted | None]
    kinds: tuple[DoubtKind, ...]


def _drive(log: Written) -> str:
    return "command" if "command" in log.quantities else "voltage"


def _sign(log: Written, rng: np.random.Generator) -> Planted:
    names = [name for name in log.quantities if name not in ("time", "yaw_rate")]
    name = str(rng.choice(names))
    return Planted(log.changed(name, scale=-log.quantities[name].get("scale", 1.0)), f"sign of {name}")


def _unit(log: Written, rng: np.random.Generator) -> Planted:
    others = {"rad": "deg", "deg": "rad", "rad/s": "deg/s", "deg/s": "rad/s", "rpm": "rad/s"}
    others |= {"N·m": "mNm", "mNm": "N·m"}
    names = [name for name, source in log.quantities.items() if source.get("unit") in others and name != "yaw_rate"]
    name = str(rng.choice(names))
    unit = log.quantities[name]["unit"]
    return Planted(log.changed(name, unit=others[unit]), f"{name}: {unit} taken for {others[unit]}")


def _row(log: Written, rng: np.random.Generator) -> Planted:
    if rng.random() < 0.5:
        return Planted(replace(log, comes_before=not log.comes_before), f"comes_before {log.comes_before} inverted")
    name = str(rng.choice(["tilt", "wheel_angle"]))
    source = log.quantities[name]["from"]
    columns = dict(log.columns)
    for column in [source] if isinstance(source, str) else source:
        columns[column] = np.concatenate([columns[column][:1], columns[column][:-1]])
    return Planted(replace(log, columns=columns), f"{name} one row late")


def _swap(log: Written, rng: np.random.Generator) -> Planted | None:
    """Where a second source tells left from right, and the robot turns: else no column says which is which."""
    source = log.quantities["wheel_angle"]["from"]
    if isinstance(source, str) or not ("yaw_rate" in log.quantities or len(log.quantities[_drive(log)]["from"]) == 2):
        return None
    left, right = (log.columns[column] for column in source)
    if np.ptp(right - left) * (np.pi / 180 if log.quantities["wheel_angle"]["unit"] == "deg" else 1.0) < _TURN:
        return None
    return Planted(log.changed("wheel_angle", **{"from": source[::-1]}), "wheels swapped")


def _rate(log: Written, rng: np.random.Generator) -> Planted:
    factor = float(rng.choice([0.5, 2 / 3, 1.5, 2.0]))
    if log.rate is not None:
        return Planted(replace(log, rate=log.rate * factor), f"rate times {factor:.2g}")
    return Planted(log.changed("time", scale=1.0 / factor), f"rate times {factor:.2g}")


def _duplicate(log: Written, rng: np.random.Generator) -> Planted:
    """A block of rows a second time, with time going on."""
    n = len(next(iter(log.columns.values())))
    count = int(n * rng.uniform(0.1, 0.5))
    begin = int(rng.integers(0, n - count))
    rows = np.concatenate([np.arange(begin + count), np.arange(begin, n)])
    columns: Mapping[str, Array] = {name: values[rows] for name, values in log.columns.items()}
    if "stamp" in columns:
        stamps = log.columns["stamp"]
        step = float(np.median(np.diff(stamps)))
        more = stamps[-1] + step * np.arange(1, len(rows) - n + 1)
        columns = {**columns, "stamp": np.concatenate([stamps, more])}
    return Planted(replace(log, columns=columns), f"{count} of {n} rows twice")


def _column(log: Written, rng: np.random.Generator) -> Planted:
    wrong = {"tilt": "angle_x", "tilt_rate": str(rng.choice(["gyro_x", "gyro_z"]))}
    wrong |= {"wheel_rate": "speed_asked", _drive(log): str(rng.choice(["battery", "speed_asked"]))}
    wrong = {
        name: column
        for name, column in wrong.items()
        if name in log.quantities and column in log.columns and np.ptp(log.columns[column])
    }
    name = str(rng.choice(list(wrong)))
    source = dict(log.quantities[name])
    if name == "voltage":
        source |= {"unit": "V"}
    source["from"] = wrong[name]
    return Planted(replace(log, quantities={**log.quantities, name: source}), f"{name} from {wrong[name]}")


def _jump(log: Written, rng: np.random.Generator) -> Planted | None:
    """A wheel's angle that wraps at a turn or is set to zero once, or one sample of an angle that is far off.

    None where the wheel does not turn so far that it would wrap, or that it matters where its zero is.
    """
    kind = str(rng.choice(["wraps", "set to zero", "spike"]))
    name = "wheel_angle" if kind != "spike" else str(rng.choice(["tilt", "wheel_angle"]))
    source = log.quantities[name]
    column = source["from"] if isinstance(source["from"], str) else str(rng.choice(source["from"]))
    radian = 180 / np.pi if source["unit"] == "deg" else 1.0
    values = log.columns[column].copy()
    if kind == "wraps":
        half = np.pi * radian
        wrapped = _with_column(log, column, (values + half) % (2.0 * half) - half, f"{column} wraps")
        return wrapped if np.ptp(values) >= _WRAPPED * radian else None
    at = int(rng.integers(len(values) // 4, 3 * len(values) // 4))
    if kind == "set to zero":
        is_far = abs(values[at]) >= _RESET * radian
        values[at:] -= values[at]
        return _with_column(log, column, values, f"{column} set to zero at row {at}") if is_far else None
    least, most = _SPIKES[name]
    values[at] += float(rng.choice([-1.0, 1.0])) * rng.uniform(least, most) * radian
    return _with_column(log, column, values, f"{column} is off in row {at}")


def _with_column(log: Written, column: str, values: Array, what: str) -> Planted:
    return Planted(replace(log, columns={**log.columns, column: values}), what)


FAULTS: Mapping[str, Fault] = {
    "sign": Fault(_sign, (DoubtKind.SIGN,)),
    "unit": Fault(_unit, (DoubtKind.UNIT,)),
    "shifted row": Fault(_row, (DoubtKind.ROW,)),
    "swapped wheels": Fault(_swap, (DoubtKind.SIDES,)),
    "wrong rate": Fault(_rate, (DoubtKind.TIME,)),
    "duplicate": Fault(_duplicate, (DoubtKind.REPEATED,)),
    "wrong column": Fault(_column, (DoubtKind.COLUMN,)),
    "jump": Fault(_jump, (DoubtKind.JUMP,)),
}
