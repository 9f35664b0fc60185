"""Tables of what was drawn, from the records of the sets."""

from collections.abc import Callable, Mapping, Sequence
from statistics import fmean, median
from typing import Any

from benchmarks.other_robots.tables import share

_HIDDEN = ("in no library", "left out")


def free_form(results: Mapping[str, Any]) -> list[str]:
    """One line for each set in which a function of one variable is hidden."""
    head = ["hidden", "", "verdict", "something remains", "drawn", "right", "error of the curve", "truth in the band"]
    lines = [f"| {' | '.join([*head, 'error of predictions less by'])} |", "|" + "---|" * 9]
    for row in results["sets"]:
        if row["kind"] not in _HIDDEN:
            continue
        remains = "yes" if row["remains"] else "no"
        cells = [row["hidden"].replace("_", " "), row["kind"], row["verdict"], remains]
        if row["drawn"] is None:
            cells += ["nothing", "", "", "", ""]
        else:
            own = [f"{row['error']:.0%}", f"{row['covered']:.0%}"] if row["right"] else ["", ""]
            drawn = f"{row['drawn']['quantity']} over {row['drawn']['variable']}"
            cells += [drawn, "yes" if row["right"] else "no", *own, f"{row['drawn']['share']:.0%}"]
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def free_form_figures(results: Mapping[str, Any]) -> list[str]:
    """How often something is drawn, and how often it is right."""
    kinds = (*_HIDDEN, "nothing")
    rows = {kind: [row for row in results["sets"] if row["kind"] == kind] for kind in kinds}
    drawn = {kind: [row for row in these if row["drawn"]] for kind, these in rows.items()}
    right = {kind: [row for row in these if row["right"]] for kind, these in drawn.items()}
    asked = {kind: [row for row in these if row["remains"]] for kind, these in rows.items()}
    cells = {
        "sets": [str(len(rows[kind])) for kind in kinds],
        "something remains, so that `twbal diagnose` looks for a function": [
            share(row["remains"] for row in rows[kind]) for kind in kinds
        ],
        "of these, one is drawn": [share(row["drawn"] is not None for row in asked[kind]) for kind in kinds],
        "of all sets, one would be drawn": [share(row["drawn"] is not None for row in rows[kind]) for kind in kinds],
        "of these, quantity and variable are right": [share(row["right"] for row in drawn[kind]) for kind in kinds],
        "of the right ones, error of the curve (median)": [_median(right[kind], "error") for kind in kinds],
        "of the right ones, points of the truth within the band": [_mean(right[kind], "covered") for kind in kinds],
        "CPU time (median) [s]": [f"{median(row['cpu_s'] for row in rows[kind]):.1f}" for kind in kinds if rows[kind]],
    }
    lines = ["| figure | in no library | left out | nothing hidden |", "|---|---|---|---|"]
    return lines + [f"| {name} | {' | '.join(values)} |" for name, values in cells.items()]


def _median(rows: Sequence[Mapping[str, Any]], key: str) -> str:
    return f"{median(row[key] for row in rows):.0%}" if rows else "-"


def _mean(rows: Sequence[Mapping[str, Any]], key: str) -> str:
    return f"{fmean(row[key] for row in rows):.0%}" if rows else "-"


PARTS: Mapping[str, Callable[[Mapping[str, Any]], list[str]]] = {
    "free_form": free_form,
    "free_form_figures": free_form_figures,
}
