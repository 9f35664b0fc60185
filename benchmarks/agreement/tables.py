"""Table of which recordings disagree with the others, from the records of the sets."""

from collections import Counter
from collections.abc import Mapping
from typing import Any

from benchmarks.other_robots.tables import share


def agreement(results: Mapping[str, Any]) -> list[str]:
    """One line for each change of the robot before the last of four recordings."""
    lines = ["| before the last recording | sets | the last one disagrees | another one does | in, most often |"]
    lines.append("|" + "---|" * 5)
    for change in dict.fromkeys(row["change"] for row in results["sets"]):
        rows = [row for row in results["sets"] if row["change"] == change]
        told = [[each for each in row["disagreements"] if each[0] == row["odd"]] for row in rows]
        others = [len(row["disagreements"]) > len(own) for row, own in zip(rows, told, strict=True)]
        most = Counter(own[0][1].replace(".", " ").replace("_", " ") for own in told if own).most_common(3)
        named = ", ".join(f"{name} ({count})" for name, count in most) or "-"
        lines.append(f"| {change} | {len(rows)} | {share(map(bool, told))} | {share(others)} | {named} |")
    return lines
