"""Tables of what the suggested experiment decides, from the records of the sets."""

from collections.abc import Callable, Mapping, Sequence
from statistics import median
from typing import Any

from benchmarks.other_robots.tables import share
from benchmarks.what_next.recording import WAYS
from twbal.diagnosis.follow_up import in_nats

Row = Mapping[str, Any]
_AFTER = {"repetition": "a repetition", "suggested": "the suggested experiment"}


_OPEN: Row = {"open": True, "named": [], "missed": []}


def is_right(said: Mapping[str, Any]) -> bool:
    """Whether it decides, and misses nothing that is hidden, and names nothing else."""
    return not said["open"] and not said["missed"] and all(right for _, right in said["named"])


def what_next(results: Mapping[str, Any]) -> list[str]:
    """One line for each way to go on, over all sets that the first recording leaves open, and by how that was made."""
    opened = [row for row in results["sets"] if row["first"]["open"]]
    lines = ["| first recording, and what follows it | sets | decided | all of it right | something wrong is named |"]
    lines.append("|" + "---|" * 5)
    for way in ("all", *WAYS):
        rows = [row for row in opened if way in ("all", row["way"])]
        for key, name in _AFTER.items():
            if rows:
                lines.append(f"| {way}, {name} | {' | '.join(_cells(rows, key))} |")
    return lines


def what_next_figures(results: Mapping[str, Any]) -> list[str]:
    """How often something was suggested, what was expected of it, and how often the hidden robot fell."""
    opened = [row for row in results["sets"] if row["first"]["open"]]
    offered = [row for row in opened if row["next"]]
    fell = [row["seconds_up"] < 9.9 for row in offered]
    both = [(row["next"]["separation"], row["next"]["repetition"]) for row in offered]
    closed = [row["first"] for row in results["sets"] if not row["first"]["open"]]
    figures = {
        "first recordings": str(len(results["sets"])),
        "not open at first": str(len(closed)),
        "of these, all of it right": share(map(is_right, closed)),
        "of these, something wrong is named": share(map(_is_wrong, closed)),
        "left open by the first recording": share(row["first"]["open"] for row in results["sets"]),
        "of these, an experiment is suggested": share(bool(row["next"]) for row in opened),
        "of these, the hidden robot falls in it": share(fell),
    }
    for key, name in (("suggested", "the suggested experiment"), ("repetition", "the repetition")):
        figures[f"decided by {name} alone"] = share(_decided(row) == [key] for row in offered)
        figures[f"decided by {name} alone, and all of it right"] = share(
            _decided(row) == [key] and is_right(row[key]) for row in offered
        )
    if both:
        medians = [median(column) for column in zip(*both, strict=True)]
        figures["expected log likelihood ratio, suggested / repetition, median"] = " / ".join(map(in_nats, medians))
    return ["| figure | value |", "|---|---|", *(f"| {name} | {value} |" for name, value in figures.items())]


def _cells(rows: Sequence[Row], key: str) -> list[str]:
    """Where nothing was suggested, nothing was decided."""
    said = [row.get(key, _OPEN) for row in rows]
    decided = [not each["open"] for each in said]
    return [str(len(rows)), share(decided), share(map(is_right, said)), share(map(_is_wrong, said))]


def _is_wrong(said: Row) -> bool:
    """Whether it decides, and names something that is not there."""
    return not said["open"] and not all(right for _, right in said["named"])


def _decided(row: Row) -> list[str]:
    """The second recordings with which a robot is no longer open."""
    return [key for key in _AFTER if not row[key]["open"]]


PARTS: Mapping[str, Callable[[Mapping[str, Any]], list[str]]] = {
    "what_next": what_next,
    "what_next_figures": what_next_figures,
}
