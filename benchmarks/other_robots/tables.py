"""Tables of the other robots, from the records of their sets."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise, product
from statistics import median
from typing import Any

import numpy as np
from scipy.stats import beta

from benchmarks.other_robots.findings import NAMED, findings, is_diagnosed, is_wrong, probabilities, sure_findings
from benchmarks.other_robots.robots import ITEMS

Row = Mapping[str, Any]
FOUND, LEAST = 0.5, 0.02
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
        hidden = [probabilities(row) for row in rows if name in row["hidden"]]
        alone = [each[name] >= FOUND for each in hidden if len(each) == 1]
        among = [each[name] >= FOUND for each in hidden if len(each) > 1]
        falsely = sum(s.name == name and s.is_likely_false(FOUND) for row in rows for s in findings(row))
        lines.append(f"| {name} | {sum(alone)} of {len(alone)} | {sum(among)} of {len(among)} | {falsely} |")
    return lines


def other_robots_lost(results: Mapping[str, Any]) -> list[str]:
    """One line a size of the share of commands that is lost: how often that was told, and how well."""
    lines = ["| share of the commands that is lost | sets | told | interval holds | excitation E told | N told |"]
    lines.append("|" + "---|" * 6)
    for low, high in pairwise(_LOST):
        rows = [row for row in results["sets"] if low <= row["lost"][0] < high and is_diagnosed(row)]
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
    columns = [
        *("what is real", "clean: something named", "severity 1: named", "found", "1/4: named", "found"),
        *("wrong (P > 0.8)", "remains", "intervals hold"),
    ]
    lines = [f"| {' | '.join(columns)} |", "|" + "---|" * len(columns)]
    for item in ITEMS:
        lines.append(_sensor_line(item, [row for row in results["sets"] if row["sensors"] == item]))
    for name, sheets in (("all, `paper`", ("paper",)), ("all, small sheets", ("regbot", "esp32", "balboa"))):
        lines.append(_sensor_line(name, [row for row in results["sets"] if row["sheet"] in sheets]))
    return [*lines, _sensor_line("all", results["sets"])]


def _sensor_line(name: str, rows: Sequence[Row]) -> str:
    clean, whole, quarter = ([r for r in rows if r["stratum"] == f"sensors {kind}"] for kind in ("clean", "1", "1/4"))
    diagnosed = list(filter(is_diagnosed, rows))
    cells = [share(any(s.is_likely_false(NAMED) for s in findings(row)) for row in filter(is_diagnosed, clean))]
    for part in (whole, quarter):
        cells += [share(p >= least for row in part for p in probabilities(row).values()) for least in (NAMED, FOUND)]
    cells.append(share(map(is_wrong, diagnosed)))
    cells.append(share(row["remains"] for row in diagnosed))
    cells.append(share(interval[-1] for row in rows for interval in row["intervals"]))
    return f"| {name} | {' | '.join(cells)} |"


def figures(rows: Sequence[Row]) -> dict[str, str]:
    """Figures over all sets that are no stratum's."""
    diagnosed = list(filter(is_diagnosed, rows))
    found = {**_sure_figures(rows), **_interval_figures(rows), **_score_figures(diagnosed)}
    lacking = [row["remains"] or _is_told_as_lost(row) for row in diagnosed if row["foreign"]]
    if lacking:
        found["sets with what the library lacks: it remains, or is told as lost commands"] = share(lacking)
    seconds = [row["cpu_s"] for row in diagnosed]
    found["CPU seconds of the command, median / 90th percentile"] = (
        f"{median(seconds):.1f} / {float(np.quantile(seconds, 0.9)):.1f}"
    )
    found["no diagnosis"] = str(len(rows) - len(diagnosed))
    found["sets with gentler effects than designed, so that the robot stays up"] = _of_all(
        r["gentler"] < 1 for r in rows
    )
    return found


def _of_all(outcomes: Iterable[bool]) -> str:
    every = list(outcomes)
    return f"{sum(every)} of {len(every)}"


def _sure_figures(rows: Sequence[Row]) -> dict[str, str]:
    """How many of the sure effects are right, with those that are easy and without them."""
    sure = sure_findings(rows)
    return {
        "effects with P of at least 0.9 that are right": share(s.is_right for s in sure),
        "the same without presliding and tilt filters": share(s.is_right for s in sure if not s.is_easy),
        "a case of what is there, or one that these data cannot tell from it": str(sum(s.is_substitute for s in sure)),
    }


def _interval_figures(rows: Sequence[Row]) -> dict[str, str]:
    found = {"95 % intervals that hold the truth": share(interval[-1] for row in rows for interval in row["intervals"])}
    for split in ("excitation", "sensors"):
        for level in sorted({row[split] for row in rows}):
            inside = [interval[-1] for row in rows if row[split] == level for interval in row["intervals"]]
            found[f"the same, {split} {level}"] = share(inside)
    return found


def _score_figures(rows: Sequence[Row]) -> dict[str, str]:
    """Scores of the probabilities; and with the hidden effects that were given less than is counted, as 0."""
    pairs = [(s.probability, s.is_right) for row in rows for s in findings(row) if s.probability >= LEAST]
    if not pairs:
        return {}
    hidden = [p for row in rows for p in probabilities(row).values()]
    silent = [(0.0, True)] * sum(p < LEAST for p in hidden)
    found = {"pairs of a set and an effect with P of at least 0.02": str(len(pairs))}
    p, right = _columns(pairs)
    found["expected calibration error, ten bins"] = f"{calibration_error(p, right):.3f}"
    for title, counted in (("", pairs), (", hidden effects given less than 0.02 included", [*pairs, *silent])):
        p, right = _columns(counted)
        base = np.full(len(p), right.mean())
        for name, loss in (("log score", log_score), ("Brier score", brier_score)):
            found[f"{name}, and of base rates{title}"] = f"{loss(p, right):.3f}, {loss(base, right):.3f}"
    found["hidden effects given less than 0.02"] = f"{len(silent)} of {len(hidden)}"
    return found


def _columns(pairs: Sequence[tuple[float, bool]]) -> tuple[np.ndarray, np.ndarray]:
    return np.array([p for p, _ in pairs]), np.array([float(right) for _, right in pairs])


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
    effects = [p for row in rows for p in probabilities(row).values()]
    diagnosed = list(filter(is_diagnosed, rows))
    false = [sum(s.is_likely_false(FOUND) for s in findings(row)) for row in diagnosed]
    return [
        str(len(rows)),
        share(p >= NAMED for p in effects),
        share(p >= FOUND for p in effects),
        f"{np.mean(false):.2f}" if false else "-",
        share(map(is_wrong, diagnosed)),
        share(row["remains"] for row in diagnosed),
    ]


def _is_told_as_lost(row: Row) -> bool:
    """Whether commands are lost, and the diagnosis tells of it, which is no effect of the library."""
    true, said = row["lost"]
    return true > 0.0 and said is not None


PARTS: Mapping[str, Callable[[Mapping[str, Any]], list[str]]] = {
    "other_robots": other_robots,
    "other_robots_splits": other_robots_splits,
    "other_robots_severities": other_robots_severities,
    "other_robots_figures": other_robots_figures,
    "other_robots_effects": other_robots_effects,
    "other_robots_lost": other_robots_lost,
    "other_robots_sensors": other_robots_sensors,
}
