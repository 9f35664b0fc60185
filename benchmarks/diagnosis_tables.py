"""Tables of the benchmarks of the diagnosis, from their results."""

import textwrap
from collections.abc import Mapping
from statistics import median
from typing import Any


def figures(results: Mapping[str, Any]) -> list[str]:
    """One line a figure of the hidden effects."""
    return ["| figure | value |", "|---|---|", *(f"| {name} | {value} |" for name, value in results["figures"].items())]


def missed(results: Mapping[str, Any]) -> list[str]:
    """One entry a set that was not diagnosed right."""
    lines = []
    for row in results["sets"]:
        if not row["right"]:
            hidden = ", ".join(f"{n} ({next(iter(p.values())):.3g})" for n, p in row["hidden"].items()) or "nothing"
            said = ", ".join(row["said"]) or "nothing"
            entry = f"- {row['stratum']}: `{row['verdict']}`, named {said}. Hidden: {hidden}."
            lines += textwrap.wrap(entry, 118, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
    return lines


def mending(results: Mapping[str, Any]) -> list[str]:
    """One line a robot of those that diagnose themselves while they learn."""
    names = "robot, trials that balance by update, real seconds without it, with it, gap closed, left for g, searches"
    lines = [f"| {names.replace(', ', ' | ')} |", "|" + "---|" * 7]
    falls = []
    for robot in results["robots"]:
        found = robot["diagnoses"]
        closed = ", ".join("-" if d["closed"] is None else f"{d['closed']:.0%}" for d in found) or "not enough data"
        left = [sum(d["left"]) / len(d["left"]) for d in found if "left" in d]
        falls += [1 - share for share in left]
        seconds = ["never" if s is None else f"{s:.1f}" for s in (robot["seconds_without"], robot["seconds_with"])]
        shares = ", ".join(f"{share:.0%}" for share in left) or "-"
        searches = ", ".join(str(d["searches"]) for d in found if "searches" in d) or "-"
        trials = " ".join(map(str, robot["successes"]))
        lines.append(f"| {robot['seed']} | {trials} | {' | '.join(seconds)} | {closed} | {shares} | {searches} |")
    both = [(r["seconds_without"], r["seconds_with"]) for r in results["robots"]]
    known = [(a, b) for a, b in both if a is not None and b is not None]
    fall = f"{median(falls):.0%}" if falls else "nothing mended"
    sums = (
        f"{sum(a for a, _ in known):.0f} s without and {sum(b for _, b in known):.0f} s with, over {len(known)} robots"
    )
    median_fall = f"Median fall of the variance that g must explain, where a simulation was corrected: {fall}."
    return [*lines, "", median_fall, f"Real seconds: {sums}."]
