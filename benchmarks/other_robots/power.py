"""Whether what a diagnosis says beforehand that it would find is what it finds.

Of each set with one effect, the same robot is recorded and diagnosed without the effect, too (`Set.bare`). That
diagnosis says with which probability the effect would have been found at its true size.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from benchmarks.other_robots.kinds import ALL
from benchmarks.other_robots.tables import FOUND, share

_BINS = (0.0, 0.05, 0.35, 0.65, 0.95, 1.0)


def said_and_found(row: Mapping[str, Any], label: Mapping[str, Any], bare: Mapping[str, Any]) -> dict[str, Any] | None:
    """The record of one set; None where it has not one effect of the library.

    Args:
        row: of the set (`score.judged`).
        label: of the set.
        bare: contents of diagnosis.json of the set without the effect.

    Returns:
        What is known of the set, and:
        effect, value: what is hidden, and the value of its first parameter.
        said: probability with which it would be found; None where the diagnosis found it although it was not there.
        found: probability that it has in the diagnosis of the set.
    """
    if len(row["hidden"]) != 1 or row["foreign"]:
        return None
    ((name, probability),) = row["hidden"].items()
    (values,) = label["hidden"].values()
    value = values[next(iter(ALL[next(iter(label["hidden"]))].sizes))]
    known = {key: row[key] for key in ("stratum", "seed", "excitation", "rate", "sheet", "tolerance", "sensors")}
    stated = [power for power in bare["power"] if power["name"] == name]
    said = round(said_at(stated[0]["sizes"], value), 4) if stated else None
    return {**known, "effect": name, "value": value, "said": said, "found": probability}


def said_at(sizes: Sequence[Mapping[str, float]], value: float) -> float:
    """Probability at a value between those that are said: linear over the logarithm of the size.

    Args:
        sizes: `share` of the usual size, `value` and `probability`.
        value: of the first parameter; what has a sign counts by its size.
    """
    shares = np.array([each["share"] for each in sizes])
    values, said = (np.array([each[key] for each in sizes]) for key in ("value", "probability"))
    is_limit = values[0] > values[-1] > 0.0
    if is_limit:  # a lower one is a larger effect
        size = values[0] * shares[0] / value
    else:
        usual, twice = (values[shares == each][0] for each in (1.0, 2.0))
        none = 2.0 * usual - twice
        size = abs(value - none) / abs(usual - none)
    return float(np.interp(np.log(size), np.log(shares), said))


def detection_power(results: Mapping[str, Any]) -> list[str]:
    """One line a range of the probability that was said."""
    rows = [row for row in results["power"] if row["said"] is not None]
    lines = ["| said that it would be found | effects | mean of what was said | found |", "|---|---|---|---|"]
    for low, high in pairwise(_BINS):
        within = [row for row in rows if low <= row["said"] < high or row["said"] == high == 1.0]
        if within:
            mean = np.mean([row["said"] for row in within])
            lines.append(f"| {low:.2f}-{high:.2f} | {len(within)} | {mean:.2f} | {share(is_found(within))} |")
    return lines


def detection_power_effects(results: Mapping[str, Any]) -> list[str]:
    """One line an effect of which some were said to be found for sure, or nearly so, and were not, or the reverse."""
    rows = [row for row in results["power"] if row["said"] is not None]
    lines = ["| effect | said at least 0.95, found | said at most 0.05, found |", "|---|---|---|"]
    for name in sorted({row["effect"] for row in rows}):
        own = [row for row in rows if row["effect"] == name]
        sure, unlikely = ([r for r in own if r["said"] >= 0.95], [r for r in own if r["said"] <= 0.05])
        if not all(is_found(sure)) or any(is_found(unlikely)):
            lines.append(f"| {name} | {share(is_found(sure))} | {share(is_found(unlikely))} |")
    return lines


def is_found(rows: Sequence[Mapping[str, Any]]) -> list[bool]:
    """Of each record, whether the effect was found."""
    return [row["found"] >= FOUND for row in rows]


POWER_PARTS: Mapping[str, Callable[[Mapping[str, Any]], list[str]]] = {
    "detection_power": detection_power,
    "detection_power_effects": detection_power_effects,
}
"""Tables of the probabilities that effects would be found."""
