"""Tables of the other robots, from the records of their sets."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise, product
from statistics import median
from typing import Any

import numpy as np
from scipy.stats import beta

from benchmarks.other_robots.robots import ITEMS

Row = Mapping[str, Any]
NAMED, FOUND, WRONG, LEAST = 0.9, 0.5, 0.8, 0.02
SINGLES, ADDED = ("single 1", "single 1/4", "single 1/8"), ("added 1", "added 1/4", "added 1/8")
SEVERAL = ("pairs", "triples", "five", "eight")
STRATA = (
    *("clean", *SINGLES, *SEVERAL),
    *("sheet", "foreign", "left out", "calibration", *ADDED, "lost"),
    *("frame 1", "frame 1/4", "frame 1/8", "shaft 1", "shaft 1/4", "shaft 1/8"),
)
_LOST = (0.0, 0.001, 0.03, 0.1, 0.4)
SPLITS = ("excitation", "sheet", "rate", "sensors", "tolerance")


def other_robots(results: Mapping[str, Any]) -> list[str]:
    """One line a stratum."""
    lines = _head("stratum")
    for stratum in STRATA:
        rows = [row for row in results["sets"] if row["stratum"] == stratum]
        if rows:
            lines.append(f"| {stratum} | {' | '.join(_cells(rows))} |")
    return lines


def other_robots_splits(results: Mapping[str, Any]) -> list[str]:
    """One line a level of what sets differ in, over all sets of which the library has all effects."""
    lines = _head("split")
    for split in SPLITS:
        for level in sorted({row[split] for row in results["sets"]}):
            rows = [row for row in results["sets"] if row[split] == level and not row["foreign"]]
            lines.append(f"| {split} {level} | {' | '.join(_cells(rows))} |")
    return lines


def other_robots_severities(results: Mapping[str, Any]) -> list[str]:
    """One line a stratum of single effects, an excitation and a quality of the sensors."""
    lines = _head("stratum, excitation, sensors")
    for stratum in ("clean", *SINGLES):
        for excitation, sensors in product(("E", "N"), ("ideal", "real")):
            wanted = stratum, excitation, sensors
            rows = [r for r in results["sets"] if (r["stratum"], r["excitation"], r["sensors"]) == wanted]
            if rows:
                lines.append(f"| {', '.join(wanted)} | {' | '.join(_cells(rows))} |")
    return lines


def _head(first: str) -> list[str]:
    columns = (first, "sets", "effects named", "effects found", "false ones a set", "wrong (P > 0.8)", "remains")
    return [f"| {' | '.join(columns)} |", "|" + "---|" * len(columns)]


def other_robots_figures(results: Mapping[str, Any]) -> list[str]:
    """Intervals, calibration and time."""
    return ["| figure | value |", "|---|---|", *(f"| {k} | {v} |" for k, v in figures(results["sets"]).items())]


def other_robots_effects(results: Mapping[str, Any]) -> list[str]:
    """One line an effect: how often it was found where it is hidden alone, and how often it was said falsely."""
    rows = results["sets"]
    names = sorted({n for r in rows for n in r["hidden"]} | {s["name"] for r in rows for s in r["said"]})
    lines = ["| effect | found alone | found among others | said falsely |", "|---|---|---|---|"]
    for name in names:
        alone = [r["hidden"][name] >= FOUND for r in rows if set(r["hidden"]) == {name}]
        among = [r["hidden"][name] >= FOUND for r in rows if name in r["hidden"] and len(r["hidden"]) > 1]
        falsely = sum(
            s["name"] == name and not s["right"] and s["probability"] >= FOUND for r in rows for s in r["said"]
        )
        lines.append(f"| {name} | {sum(alone)} of {len(alone)} | {sum(among)} of {len(among)} | {falsely} |")
    return lines


def other_robots_versions(*records: Mapping[str, Any]) -> list[str]:
    """One line a record, each by a version of its own, of robots of its own."""
    columns = ("commit", "robots", "of effects with P >= 0.9, right", "found alone", "of two", "of three")
    columns = (*columns, "of five", "of eight", "wrong (P > 0.8)", "remains", "intervals hold")
    lines = [f"| {' | '.join(columns)} |", "|" + "---|" * len(columns)]
    for record in records:
        rows = [row for row in record["sets"] if not row["foreign"]]
        found = {
            stratum: [p >= FOUND for row in rows if row["stratum"] == stratum for p in row["hidden"].values()]
            for stratum in STRATA
        }
        alone = [each for stratum in (*SINGLES, *ADDED) for each in found[stratum]]
        said = [s["right"] for row in rows for s in row["said"] if s["probability"] >= NAMED]
        wrong = [any(_is_false(s, WRONG + 1e-9) for s in row["said"]) for row in rows]
        held = [interval[-1] for row in rows for interval in row["intervals"]]
        remains = [row["remains"] for row in rows]
        counts = (said, alone, *(found[stratum] for stratum in SEVERAL), wrong, remains, held)
        cells = [f"{sum(each)} of {len(each)}" if each else "-" for each in counts]
        lines.append(f"| {record['commit']} | {len(rows)} | {' | '.join(cells)} |")
    return lines


def other_robots_lost(results: Mapping[str, Any]) -> list[str]:
    """One line a size of the share of commands that is lost: how often that was told, and how well."""
    lines = ["| share of the commands that is lost | sets | told | interval holds | excitation E told | N told |"]
    lines.append("|" + "---|" * 6)
    for low, high in pairwise(_LOST):
        rows = [row for row in results["sets"] if low <= row["lost"][0] < high]
        if not rows:
            continue
        told = {e: [row["lost"][1] is not None for row in rows if row["excitation"] == e] for e in ("E", "N")}
        held = [said[1] <= true <= said[2] for true, said in (row["lost"] for row in rows) if said is not None]
        name = "none" if low == 0.0 else f"{100 * low:g} to {100 * high:g} %"
        both = share([*told["E"], *told["N"]])
        lines.append(f"| {name} | {len(rows)} | {both} | {share(held)} | {share(told['E'])} | {share(told['N'])} |")
    return lines


def other_robots_sensors(results: Mapping[str, Any]) -> list[str]:
    """One line an item of real sensors: what is said of clean robots, and of one effect of two sizes."""
    columns = ("what is real", "clean: something named", "severity 1: named", "found", "1/4: named", "found")
    columns = (*columns, "wrong (P > 0.8)", "remains", "intervals hold")
    lines = [f"| {' | '.join(columns)} |", "|" + "---|" * len(columns)]
    for item in ITEMS:
        lines.append(_sensor_line(item, [row for row in results["sets"] if row["sensors"] == item]))
    for name, sheets in (("all, `paper`", ("paper",)), ("all, small sheets", ("regbot", "esp32", "balboa"))):
        lines.append(_sensor_line(name, [row for row in results["sets"] if row["sheet"] in sheets]))
    return [*lines, _sensor_line("all", results["sets"])]


def _sensor_line(name: str, rows: Sequence[Row]) -> str:
    clean, whole, quarter = ([r for r in rows if r["stratum"] == f"sensors {kind}"] for kind in ("clean", "1", "1/4"))
    cells = [share(any(_is_false(s, NAMED) for s in row["said"]) for row in clean)]
    for part in (whole, quarter):
        cells += [share(p >= least for row in part for p in row["hidden"].values()) for least in (NAMED, FOUND)]
    cells.append(share(any(_is_false(s, WRONG + 1e-9) for s in row["said"]) for row in rows))
    cells.append(share(row["remains"] for row in rows))
    cells.append(share(interval[-1] for row in rows for interval in row["intervals"]))
    return f"| {name} | {' | '.join(cells)} |"


def figures(rows: Sequence[Row]) -> dict[str, str]:
    """Figures over all sets that are no stratum's."""
    held = [interval[-1] for row in rows for interval in row["intervals"]]
    pairs = [(s["probability"], s["right"]) for row in rows for s in row["said"] if s["probability"] >= LEAST]
    found = {"95 % intervals that hold the truth": share(held)}
    for split in ("excitation", "sensors"):
        for level in sorted({row[split] for row in rows}):
            inside = [interval[-1] for row in rows if row[split] == level for interval in row["intervals"]]
            found[f"the same, {split} {level}"] = share(inside)
    if pairs:
        p, right = np.array([a for a, _ in pairs]), np.array([float(b) for _, b in pairs])
        base = np.full(len(p), right.mean())
        found["pairs of a set and an effect with P of at least 0.02"] = str(len(p))
        found["expected calibration error, ten bins"] = f"{calibration_error(p, right):.3f}"
        for name, loss in (("log score", log_score), ("Brier score", brier_score)):
            found[f"{name}, and of base rates"] = f"{loss(p, right):.3f}, {loss(base, right):.3f}"
    lacking = [row["remains"] or _is_told_as_lost(row) for row in rows if row["foreign"]]
    if lacking:
        found["sets with what the library lacks: it remains, or is told as lost commands"] = share(lacking)
    seconds = [row["cpu_s"] for row in rows]
    found["CPU seconds of the command, median / 90th percentile"] = (
        f"{median(seconds):.1f} / {float(np.quantile(seconds, 0.9)):.1f}"
    )
    found["no diagnosis"] = str(sum(row["verdict"] == "no diagnosis" for row in rows))
    return found


def share(outcomes: Iterable[bool]) -> str:
    """k of n, and the 95 % interval of Clopper and Pearson (1934)."""
    all_of_them = list(outcomes)
    k, n = sum(all_of_them), len(all_of_them)
    if not n:
        return "-"
    low, high = clopper_pearson(k, n)
    return f"{k} of {n} ({100 * low:.0f}-{100 * high:.0f} %)"


def clopper_pearson(k: int, n: int, level: float = 0.95) -> tuple[float, float]:
    """Interval of a probability by which `k` of `n` came."""
    tail = 0.5 * (1.0 - level)
    low = float(beta.ppf(tail, k, n - k + 1)) if k else 0.0
    return low, float(beta.ppf(1.0 - tail, k + 1, n - k)) if k < n else 1.0


def calibration_error(p: np.ndarray, right: np.ndarray) -> float:
    """Mean gap between probability and frequency over ten bins of equal width, weighted by their pairs."""
    bins = np.minimum((10 * p).astype(int), 9)
    return float(sum(abs(p[bins == b].mean() - right[bins == b].mean()) * (bins == b).mean() for b in np.unique(bins)))


def log_score(p: np.ndarray, right: np.ndarray) -> float:
    """Mean -log of the probability of what is true; probabilities count as 0.001 at least."""
    return float(-np.mean(np.log(np.maximum(np.where(right > 0, p, 1.0 - p), 1e-3))))


def brier_score(p: np.ndarray, right: np.ndarray) -> float:
    """Mean square of probability less truth."""
    return float(np.mean((p - right) ** 2))


def _cells(rows: Sequence[Row]) -> list[str]:
    effects = [probability for row in rows for probability in row["hidden"].values()]
    false = [sum(_is_false(s, FOUND) for s in row["said"]) for row in rows]
    return [
        str(len(rows)),
        share(p >= NAMED for p in effects),
        share(p >= FOUND for p in effects),
        f"{np.mean(false):.2f}",
        share(any(_is_false(s, WRONG + 1e-9) for s in row["said"]) for row in rows),
        share(row["remains"] for row in rows),
    ]


def _is_told_as_lost(row: Row) -> bool:
    """Whether commands are lost, and the diagnosis tells of it, which is no effect of the library."""
    true, said = row["lost"]
    return true > 0.0 and said is not None


def _is_false(said: Mapping[str, Any], least: float) -> bool:
    return not said["right"] and said["probability"] >= least


VERSIONS: Mapping[str, Callable[..., list[str]]] = {"other_robots_versions": other_robots_versions}

PARTS: Mapping[str, Callable[[Mapping[str, Any]], list[str]]] = {
    "other_robots": other_robots,
    "other_robots_splits": other_robots_splits,
    "other_robots_severities": other_robots_severities,
    "other_robots_figures": other_robots_figures,
    "other_robots_effects": other_robots_effects,
    "other_robots_lost": other_robots_lost,
    "other_robots_sensors": other_robots_sensors,
}
