"""How right the diagnoses were."""

from collections.abc import Mapping, Sequence
from statistics import median
from typing import Any

import numpy as np

GROUPS = {
    "torque_gain": "gain, mass and inertia",
    "body_mass": "gain, mass and inertia",
    "body_inertia": "gain, mass and inertia",
    "com_height": "COM height and wheel radius",
    "wheel_radius": "COM height and wheel radius",
}
"""Class that a value of the data sheet belongs to."""


_CPU = "CPU seconds of the whole command, median"
_SINCE = {
    "closed": "from the nominal",
    "closed_from_refitted": "from the refitted data sheet",
    "closed_noise_free": "against the noise-free truth",
}
FLOOR = "ground_waves"
"""What an uneven floor may be named: it is no fault of the robot, and no false alarm."""
_FLAT = 0.1  # share of the floor by which a gap must exceed it for a share of it to mean anything


def score(
    labels: Mapping[str, Any],
    diagnoses: Mapping[str, Any],
    cpu_s: Mapping[str, float],
    noise_free: Mapping[str, float | None],
) -> dict[str, Any]:
    """The figures over all sets, and what became of each set.

    Args:
        labels: what is hidden in each set.
        diagnoses: contents of their diagnosis.json.
        cpu_s: CPU seconds of each diagnosis.
        noise_free: share of the gap to the noise-free truth that each named effect closes.
    """
    rows = [
        {"name": name, **_row(labels[name], diagnoses[name]), "closed_noise_free": noise_free.get(name)}
        for name in sorted(labels)
        if name in diagnoses
    ]
    failed = {name: labels[name]["stratum"] for name in sorted(set(labels) - set(diagnoses))}
    figures = {**figures_of(rows, failed), _CPU: round(median(cpu_s.values()), 1)}
    return {"figures": figures, "sets": rows, "failed": list(failed), "failed_strata": failed}


def figures_of(rows: Sequence[Mapping[str, Any]], failed: Mapping[str, str]) -> dict[str, Any]:
    """The figures over all sets.

    Args:
        rows: of the sets that were diagnosed.
        failed: by name, the strata of those that were not; they count as not right.
    """
    figures: dict[str, Any] = {}
    for stratum in sorted({*(row["stratum"] for row in rows), *failed.values()}):
        inside = [row["right"] for row in rows if row["stratum"] == stratum]
        figures[f"right, {stratum}"] = f"{sum(inside)} of {len(inside) + list(failed.values()).count(stratum)}"
    figures["wrong name, all strata"] = f"{sum(row['wrong'] for row in rows)} of {len(rows)}"
    figures |= _closed_figures([row for row in rows if row["said"]])
    errors = [error for row in rows for error in row["errors"]]
    if errors:
        figures["parameter error, median"] = round(median(errors), 3)
        held = [inside for row in rows for inside in row["held"]]
        figures["95 % intervals that hold the truth"] = f"{sum(held)} of {len(held)}"
    surest = [(row["probability"], row["right"]) for row in rows if row["said"]]
    if surest:
        figures["expected calibration error"] = round(_calibration_error(surest), 3)
    figures["no diagnosis"] = len(failed)
    return figures


def _closed_figures(named: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """How far gaps close in all sets in which something is named, right or not; those with backlash apart."""
    figures = {}
    for title, has_backlash in (("", False), (", where backlash is named", True)):
        rows = [row for row in named if ("backlash" in row["said"]) == has_backlash]
        for key, since in _SINCE.items():
            closed = [row[key] for row in rows if row[key] is not None]
            if closed:
                tenth = float(np.quantile(closed, 0.1))
                name = f"gap closed{title}, {since}: median (10th percentile) of {len(closed)} sets"
                figures[name] = f"{median(closed):.3f} ({tenth:.3f})"
    return figures


def _row(label: Mapping[str, Any], diagnosis: Mapping[str, Any]) -> dict[str, Any]:
    """What became of one set."""
    hidden, said = label["hidden"], [effect for effect in diagnosis["effects"] if effect["is_named"]]
    alike = [{effect["name"], *effect["equivalents"]} for effect in said]
    stratum, verdict = label["stratum"], diagnosis["verdict"]
    if stratum in ("clean", "uneven"):
        right = verdict in ("none", "undecided", "data_sheet") or (
            stratum == "uneven" and [effect["name"] for effect in said] == [FLOOR]
        )
        wrong = verdict == "named" and not right
    elif stratum in ("foreign", "left out"):
        right, wrong = verdict == "unknown", verdict == "named"
    elif stratum == "data sheet":
        right = verdict == "data_sheet" and GROUPS[next(iter(hidden))] in diagnosis["data_sheet_class"]
        wrong = verdict == "named"
    elif stratum == "serial":  # hides more than any data tell: what is named must be there
        wrong = any(not group & set(hidden) for group in alike)
        right = verdict == "named" and not wrong
    else:
        right = len(alike) == len(hidden) and all(any(name in group for group in alike) for name in hidden)
        wrong = verdict == "named" and any(not group & set(hidden) for group in alike)
        if stratum == "still":
            right = right or verdict in ("undecided", "none", "unknown", "data_sheet")
    errors, held = _parameters(hidden, said) if right else ([], [])
    return {
        "stratum": stratum,
        "hidden": hidden,
        "verdict": verdict,
        "said": [effect["name"] for effect in said],
        "right": bool(right),
        "wrong": bool(wrong),
        "probability": min((effect["probability"] for effect in said), default=None),
        "closed": diagnosis["gap"]["closed"],
        "closed_from_refitted": _closed_from_refitted(diagnosis["gap"]),
        "errors": errors,
        "held": held,
    }


def _closed_from_refitted(gap: Mapping[str, Any]) -> float | None:
    """Share of the gap between the refitted data sheet and the noise floor that the named effect closes."""
    if gap["refitted"] <= (1.0 + _FLAT) * gap["noise_floor"]:
        return None
    return float((gap["refitted"] - gap["after"]) / (gap["refitted"] - gap["noise_floor"]))


def _parameters(hidden: Mapping[str, Any], said: Any) -> tuple[list[float], list[bool]]:
    """Relative errors of the first parameter of each effect that was named as it is, and whether its interval holds."""
    errors, held = [], []
    for effect in said:
        if effect["name"] not in hidden:
            continue
        key, true = next(iter(hidden[effect["name"]].items()))
        found = effect["parameters"].get(key)
        if found is not None:
            errors.append(abs(found["value"] - true) / abs(true))
            held.append(found["low95"] <= true <= found["high95"])
    return errors, held


def _calibration_error(pairs: list[tuple[float, bool]]) -> float:
    """Mean gap between probability and frequency over ten bins of equal width, weighted by their sets."""
    p, right = np.array([a for a, _ in pairs]), np.array([float(b) for _, b in pairs])
    bins = np.minimum((10 * p).astype(int), 9)
    return float(sum(abs(p[bins == b].mean() - right[bins == b].mean()) * (bins == b).mean() for b in np.unique(bins)))
