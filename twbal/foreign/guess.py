"""A first mapping for a log that nobody has described yet, from its columns' names and numbers."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from twbal.foreign.arrays import ENDINGS, named_arrays
from twbal.foreign.mapping import QUANTITIES, UNITS
from twbal.foreign.text import layout_of, read_text
from twbal.gaussian import Array

_WORDS = {
    "time": r"^(t|time|timestamp|stamp|clock|millis|micros|sec|seconds)(_?(s|ms|us|ns))?$",
    "tilt_rate": r"gyro_?y|pitch_?(rate|vel|dot)|tilt_?(rate|vel|dot)|theta_?dot|dtheta|^q$|^gy$",
    "yaw_rate": r"gyro_?z|yaw_?(rate|vel|dot)|turn_?rate|^gz$",
    "tilt": r"tilt|pitch|lean|theta|body_?angle|^angle$",
    "acceleration": r"acc(el)?(eration)?(_?x)?$|^ax$",
    "wheel_rate": r"(wheel|motor|enc(oder)?)\w*(rate|vel|velocity|speed|rpm|omega)|phi_?dot|dphi",
    "wheel_angle": r"(wheel|motor|enc(oder)?)\w*(angle|pos|position|count|tick|ticks|rad|deg)|^phi(_?[lr])?$|^enc\w*$",
    "distance": r"dist(ance)?|odo(metry)?|travel",
    "heading": r"heading|^yaw$|^psi$",
    "command": r"torque|^tau|^u(_?[lr12])?$|command|cmd",
    "voltage": r"volt(age)?(_?(l|r|left|right))?$|motor_?v$|^v_?mot",
}
"""What columns of a quantity are called, in the order in which they are looked for."""

_NOT = re.compile(r"ref|target|setpoint|desired|batt|limit|error", re.IGNORECASE)
_UNIT = re.compile(
    r"[\[(]([^\])]+)[\])]\s*$|_(s|ms|us|ns|rad|deg|rad_s|deg_s|dps|rpm|m|mm|cm|v|mv|nm|g)$", re.IGNORECASE
)
_ALIASES = {"rad_s": "rad/s", "deg_s": "deg/s", "dps": "deg/s", "degrees": "deg", "v": "V", "mv": "mV", "nm": "N·m"}
_SHOWN = 5


class Guess(NamedTuple):
    """What a log looks like.

    Attributes:
        table: one line a column: number, name, smallest, largest and first values.
        mapping: a yaml file for conf/import/, with ??? where nothing was found.
        missing: quantities that were looked for in vain.
    """

    table: tuple[str, ...]
    mapping: str
    missing: tuple[str, ...]


def guess(path: Path) -> Guess:
    """Propose a mapping for a log.

    Raises:
        LogError: it cannot be read.
    """
    names, columns = _all_columns(path)
    found = _by_name(names)
    if "time" not in found and (clock := _clock(columns)) is not None:
        found["time"] = [clock]
    lines = [f"# Proposed by `twbal import-log guess=true` for {path.name}: look through every line.", "defaults:"]
    lines += ["  - columns", "  - _self_", "", "quantities:"]
    for name in QUANTITIES:
        if name in found:
            lines.append(_line(name, found[name], names, columns))
    missing = [name for name in ("time", "tilt") if name not in found]
    if not {"wheel_angle", "wheel_rate", "distance"} & set(found):
        missing.append("wheel_angle")
    if not {"command", "voltage"} & set(found):
        missing.append("command")
    for name in missing:
        lines.append(f"  {name}: {{from: ???, unit: {QUANTITIES[name]}}}  # not found among the names")
    # what the packaged mapping `columns` expects and this log does not have
    for name in ("time", "tilt", "tilt_rate", "acceleration", "yaw_rate", "wheel_angle", "wheel_rate", "command"):
        if name not in found and name not in missing:
            lines.append(f"  {name}: null")
    if "voltage" in found:
        lines += ["motor:  # both as one; from its data sheet", "  _target_: twbal.robot.motor.Motor"]
        lines += [
            "  resistance: ???       # ohm",
            "  torque_constant: ???  # N·m/A",
            "  gear: ???",
            "  supply: ???  # V",
        ]
    table = [_row(k, name, column) for k, (name, column) in enumerate(zip(names, columns.T, strict=True), start=1)]
    return Guess(tuple(table), "\n".join(lines) + "\n", tuple(missing))


def _all_columns(path: Path) -> tuple[list[str], Array]:
    """Names of all columns that hold numbers ("" without one), and their values; NaN where a field is no number."""
    if path.suffix in ENDINGS:
        arrays = named_arrays(path)
        return list(arrays), np.column_stack(list(arrays.values()))
    layout = layout_of(path, path.read_bytes())
    numbers = [k for k in range(layout.width) if all(_plain(row[k]) for row in layout.sample if k < len(row))]
    read = read_text(path, [k + 1 for k in numbers])
    values = np.full((len(read.values), layout.width), np.nan)
    values[:, numbers] = read.values
    return list(layout.names) or [""] * layout.width, values


def _plain(field: str) -> bool:
    return bool(re.fullmatch(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?|[+-]?(nan|inf)|", field, re.IGNORECASE))


def _by_name(names: Sequence[str]) -> dict[str, list[int]]:
    """Columns of each quantity, by their names; a left and a right one together."""
    found: dict[str, list[int]] = {}
    taken: set[int] = set()
    for quantity, words in _WORDS.items():
        bare = [_UNIT.sub("", name).strip(" _") for name in names]
        fits = [
            k
            for k, (name, whole) in enumerate(zip(bare, names, strict=True))
            if k not in taken
            and not _NOT.search(name)
            and (re.search(words, name, re.IGNORECASE) or re.search(words, whole, re.IGNORECASE))
        ]
        sides = [k for k in fits if re.search(r"(left|right|_?[lr]|[12])$", bare[k], re.IGNORECASE)]
        if fits:
            found[quantity] = sides[:2] if len(sides) == 2 else fits[:1]
            taken.update(found[quantity])
    return found


def _clock(columns: Array) -> int | None:
    """The first column that only ever grows, by steps of about one size."""
    for k, column in enumerate(columns.T):
        steps = np.diff(column)
        if len(steps) and np.isfinite(column).all() and (steps > 0).all() and steps.max() < 20 * np.median(steps):
            return k
    return None


def _line(name: str, found: Sequence[int], names: Sequence[str], columns: Array) -> str:
    sources = [f"'{names[k]}'" if names[k] else str(k + 1) for k in found]
    source = sources[0] if len(sources) == 1 else f"[{', '.join(sources)}]"
    unit, why = _unit(name, names[found[0]], columns[:, found[0]])
    return f"  {name}: {{from: {source}, unit: {unit}}}  # {why}"


def _unit(quantity: str, name: str, column: Array) -> tuple[str, str]:
    """A unit, and where it is taken from."""
    known = UNITS[QUANTITIES[quantity]]
    said = _UNIT.search(name)
    if said:
        word = next(part for part in said.groups() if part)
        unit = _ALIASES.get(word.lower(), word)
        if unit in known:
            return unit, "unit by its name"
    largest = float(np.nanmax(np.abs(column))) if np.isfinite(column).any() else 0.0
    if quantity == "time":
        step = float(np.nanmedian(np.diff(column)))
        return ("s" if step < 0.5 else "ms" if step < 500 else "us"), f"unit by its steps of {step:.6g}"
    if quantity == "tilt":
        return ("rad" if largest < 3.5 else "deg"), f"unit by its largest value, {largest:.3g}"
    return QUANTITIES[quantity], "UNIT NOT KNOWN: check it"


def _row(number: int, name: str, column: Array) -> str:
    if not np.isfinite(column).any():
        return f"{number:4d}  {name:24} no numbers"
    first = ", ".join(f"{value:.6g}" for value in column[:_SHOWN])
    return f"{number:4d}  {name:24} {np.nanmin(column):12.6g} to {np.nanmax(column):12.6g}   {first}, ..."
