"""What became of each set: which of what is hidden was said, how surely, and what was said that is not there."""

import math
from collections.abc import Collection, Mapping
from typing import Any

from benchmarks.other_robots.kinds import ALIKE, ALL, FOREIGN, KNOWN_SINCE, equivalents

TILT_FILTER, PRESLIDING = "tilt_filter", "presliding"
DRY = ("coulomb_friction", "stribeck_friction", "rolling_resistance")
CLASSES = (
    ("gain, mass and inertia", {"torque_gain", "body_mass", "body_inertia"}),
    ("COM height and wheel radius", {"com_height", "wheel_radius"}),
)
"""Values of the data sheet that such data hardly tell apart, and what a diagnosis calls them."""


def judged(label: Mapping[str, Any], diagnosis: Mapping[str, Any] | None, cpu_s: float) -> dict[str, Any]:
    """The record of one set.

    Args:
        label: of the set, with what is hidden.
        diagnosis: contents of its diagnosis.json, of schema 2 or without a schema; None where there is none.
        cpu_s: CPU seconds of the command.

    Returns:
        What is known of the set (severity: by its design; driven_severity: as it was driven, gentler where the robot
        would not stay up), and:
        hidden: by effect that the library has, the largest probability of it or of a declared equivalent (0: nothing).
        foreign: other effects that are hidden.
        said: name, probability, and whether it is there, or is a case of what is there, or one that these data cannot
            tell from it (`findings` tells these apart).
        intervals: (effect, parameter, true value, value, low, high, whether it holds).
        remains: whether something is said to remain that nothing explains.
        lost: share of the commands that are lost, and what was said of it: share, low and high end, or None.
    """
    known = {key: label[key] for key in ("stratum", "seed", "excitation", "rate", "sheet", "tolerance", "sensors")}
    known |= {"gentler": round(label["gentler"], 3), "stays_up": label["stays_up"]}
    for key, factor in (("severity", 1.0), ("driven_severity", label["gentler"])):
        known[key] = {name: round(factor * severity, 4) for name, severity in label["effects"].items()}
    known["cpu_s"] = round(cpu_s, 1)
    hidden = {_of_library(name, label): values for name, values in label["hidden"].items()}
    foreign = set(FOREIGN).difference(KNOWN_SINCE).union(label["left_out"])
    missing = [name for name in hidden if name in foreign]
    there = [name for name in hidden if name not in missing]
    filtered, bending = _tilt_filter(label), presliding_of(there)
    if diagnosis is None:
        return {**known, "verdict": "no diagnosis", "hidden": dict.fromkeys(there, 0.0), "foreign": missing} | {
            "said": [], "intervals": [], "remains": False, "lost": _lost(hidden, {}),
        }  # fmt: skip
    said = [
        {
            "name": e["name"],
            "probability": round(e["probability"], 4),
            "right": is_there(e, [*there, *filtered, *bending]),
        }
        | ({"uncalibrated": round(e["uncalibrated"], 6), "objected": e["objected"]} if "objected" in e else {})
        for e in diagnosis["effects"]
    ]
    sure = dict.fromkeys(there, 0.0)
    for effect in diagnosis["effects"]:
        for name in there:
            if equivalents(effect["name"]) & class_of(name):
                sure[name] = max(sure[name], effect["probability"])
    for title, names in CLASSES:
        for name in names & set(there):
            if diagnosis["verdict"] == "data_sheet" and title in diagnosis.get("data_sheet_class", ()):
                sure[name] = 1.0
    return {
        **known,
        "verdict": diagnosis["verdict"],
        "hidden": {name: round(probability, 4) for name, probability in sure.items()},
        "foreign": missing,
        "said": said,
        "intervals": [row for effect in diagnosis["effects"] for row in _intervals(effect, {**hidden, **filtered})],
        "remains": _remains(diagnosis),
        "lost": _lost(hidden, diagnosis),
    }


def _of_library(name: str, label: Mapping[str, Any]) -> str:
    """What the library calls a hidden effect on a set's sensors."""
    is_behind = name == "backlash" and label["sensor_values"]["on_shaft"] > 0.0
    return "backlash_behind_encoder" if is_behind else name


def _tilt_filter(label: Mapping[str, Any]) -> dict[str, dict[str, float]]:
    """The filter that a tilt of real quality comes from: there, though it is not hidden.

    In a control period T it keeps τ / (τ + T) of its error, which is exp(-rate T).
    """
    constant, period = label["sensor_values"]["tilt_constant"], 1.0 / label["rate"]
    return {TILT_FILTER: {"rate": math.log1p(period / constant) / period}} if constant > 0 else {}


def presliding_of(there: Collection[str]) -> tuple[str, ...]:
    """What the form of the dry friction is besides: bristles bend before it slides (`mechanics.bristles`).

    They are damped, which the library's are not, so the angle has no true value.
    """
    return (PRESLIDING,) if any(name in there for name in DRY) else ()


def _meant(effect: Mapping[str, Any]) -> set[str]:
    """Effects that a finding stands for."""
    names = {effect["name"], *effect["equivalents"]}
    return names.union(*(equivalents(name) for name in names))


def class_of(name: str) -> set[str]:
    """An effect, or a value of the data sheet with the others of its class."""
    return next((names for _, names in CLASSES if name in names), {name})


def is_there(effect: Mapping[str, Any], there: list[str]) -> bool:
    """Whether a finding is of something that is hidden, or of a case of it."""
    meant = _meant(effect)
    for group in (*ALIKE, *(names for _, names in CLASSES)):
        if meant & group and group & set(there):
            return True
    return bool(meant & set(there))


def _intervals(effect: Mapping[str, Any], hidden: Mapping[str, Mapping[str, float]]) -> list[list[Any]]:
    """Intervals of a likely finding of what is hidden under its own name."""
    name = effect["name"]
    if name not in hidden or effect["probability"] < 0.5:
        return []
    kind, rows = ALL.get(name), []
    for key in hidden[name] if kind is None else (*kind.sizes, *kind.drawn):
        found = effect["parameters"].get(key)
        if found is None or key not in hidden[name] or (kind is not None and key in kind.unfit):
            continue
        true, ends = hidden[name][key], (found["low95"], found["high95"])
        rows.append([name, key, true, found["value"], *ends, ends[0] <= true <= ends[1]])
    return rows


def _lost(hidden: Mapping[str, Mapping[str, float]], diagnosis: Mapping[str, Any]) -> list[Any]:
    told = diagnosis.get("lost_commands")
    said = None if told is None else [round(told[key], 5) for key in ("share", "low95", "high95")]
    return [hidden.get("command_loss", {}).get("share", 0.0), said]


def _remains(diagnosis: Mapping[str, Any]) -> bool:
    if diagnosis.get("schema", 1) >= 2:
        return bool(diagnosis["remaining"]["is_beyond_noise"])
    return bool(diagnosis["verdict"] == "unknown")
