"""What recordings show of several effects at once, as a table."""

from collections.abc import Mapping
from statistics import median
from typing import Any

from benchmarks.other_robots.tables import STRATA, share

MIN_SCORE = 20.0
"""From which on an effect is shown: clearly more than chance makes the best effect score."""
MAX_AUTOCORRELATION = 8.0
"""Residual autocorrelation above which a diagnosis stays `unknown` (`thresholds.max_autocorrelation`)."""


def effects_shown(results: Mapping[str, Any]) -> list[str]:
    """One line a stratum."""
    head = ("stratum", "sets", "effects shown", "autocorrelation, median", "above 8", "predictions diverge")
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    for stratum in STRATA:
        rows = [row for row in results["sets"] if row["stratum"] == stratum]
        if rows:
            left = [row["autocorrelation"] for row in rows if row["autocorrelation"] is not None]
            shown = share(score >= MIN_SCORE for row in rows for score in row["shown"].values())
            above = share(autocorrelation > MAX_AUTOCORRELATION for autocorrelation in left)
            middle = f"{median(left):.1f}" if left else "-"
            lines.append(f"| {stratum} | {len(rows)} | {shown} | {middle} | {above} | {len(rows) - len(left)} |")
    return lines
