"""Tables of several records of other robots beside one another."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from benchmarks.other_robots.findings import is_diagnosed, is_wrong, probabilities, sure_findings
from benchmarks.other_robots.tables import ADDED, FOUND, SEVERAL, SINGLES, STRATA, share


def other_robots_versions(*records: Mapping[str, Any]) -> list[str]:
    """One line a record, each by a version of its own, of robots of its own."""
    columns = [
        *("commit", "robots", "of effects with P >= 0.9, right", "without the easy ones", "a case of it, or alike"),
        *("found alone", "of two", "of three", "of five", "of eight", "wrong (P > 0.8)", "remains", "intervals hold"),
    ]
    lines = [f"| {' | '.join(columns)} |", "|" + "---|" * len(columns)]
    for record in records:
        rows = [row for row in record["sets"] if not row["foreign"]]
        diagnosed = list(filter(is_diagnosed, rows))
        found = {
            stratum: [p >= FOUND for row in rows if row["stratum"] == stratum for p in probabilities(row).values()]
            for stratum in STRATA
        }
        alone = [each for stratum in (*SINGLES, *ADDED) for each in found[stratum]]
        sure = sure_findings(rows)
        right, hard = ([s.is_right for s in part] for part in (sure, [s for s in sure if not s.is_easy]))
        held = [interval[-1] for row in rows for interval in row["intervals"]]
        remains = [row["remains"] for row in diagnosed]
        counts = (alone, *(found[stratum] for stratum in SEVERAL), [is_wrong(row) for row in diagnosed], remains, held)
        cells = [_of(right), _of(hard), str(sum(s.is_substitute for s in sure)), *map(_of, counts)]
        lines.append(f"| {record['commit']} | {len(rows)} | {' | '.join(cells)} |")
    return lines


def other_robots_unseen(results: Mapping[str, Any], others: Mapping[str, Any]) -> list[str]:
    """Figures of all robots, and without those whose hidden values another benchmark had used before.

    Args:
        results: of the robots.
        others: records of the other benchmark, of robots of the same strata and seeds.
    """
    seen = {(row["stratum"], row["seed"]) for row in others["sets"]}
    rows = results["sets"]
    unseen = [row for row in rows if (row["stratum"], row["seed"]) not in seen]
    lines = [f"| figure | all {len(rows)} robots | the {len(unseen)} others |", "|---|---|---|"]
    both = zip(*(_headline(part) for part in (rows, unseen)), strict=True)
    return lines + [f"| {name} | {everywhere} | {without} |" for (name, everywhere), (_, without) in both]


def _headline(rows: Sequence[Mapping[str, Any]]) -> list[tuple[str, str]]:
    known = [row for row in rows if not row["foreign"]]
    diagnosed = list(filter(is_diagnosed, known))
    sure = sure_findings(rows)
    hidden = [p for row in known for p in probabilities(row).values()]
    return [
        ("effects with P of at least 0.9 that are right", share(s.is_right for s in sure)),
        ("the same without presliding and tilt filters", share(s.is_right for s in sure if not s.is_easy)),
        ("hidden effects that are found", share(p >= FOUND for p in hidden)),
        ("sets whose effects the library has: something wrong (P > 0.8)", share(map(is_wrong, diagnosed))),
        ("the same: something is said to remain", share(row["remains"] for row in diagnosed)),
        ("95 % intervals that hold the truth", share(i[-1] for row in rows for i in row["intervals"])),
    ]


def _of(outcomes: Sequence[bool]) -> str:
    return f"{sum(outcomes)} of {len(outcomes)}" if outcomes else "-"


VERSIONS: Mapping[str, Callable[..., list[str]]] = {
    "other_robots_versions": other_robots_versions,
    "other_robots_unseen": other_robots_unseen,
}
