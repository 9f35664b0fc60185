"""Tables of the correction of probabilities, and of how often corrected ones proved right."""

from collections.abc import Mapping
from typing import Any

from benchmarks.calibration.fit import reliability
from benchmarks.other_robots.findings import findings
from benchmarks.other_robots.tables import LEAST, share
from twbal.diagnosis.calibration import Objected, calibration

_SURE = 0.9  # probability before its correction, from which on an effect counts as sure
_WHAT = {
    Objected.NOTHING: "nothing",
    Objected.OTHERS: "other effects, or the set as a whole (residuals stayed autocorrelated, ...)",
    Objected.EFFECT: "the effect itself",
}


def calibration_table(records: Mapping[str, Any]) -> list[str]:
    """What a probability of 0.5 and of 1 becomes, by what is objected to; and how many sure effects proved right."""
    lines = [
        "| objected to | of sure effects, right | 0.5 becomes | 1 becomes |",
        "|---|---|---|---|",
    ]
    for kind, text in _WHAT.items():
        sure = [
            said["right"]
            for row in records["sets"]
            for said in row["said"]
            if said["uncalibrated"] >= _SURE and said["objected"] == kind
        ]
        half, one = (calibration().corrected(p, kind) for p in (0.5, 1.0))
        lines.append(f"| {text} | {share(sure)} | {half:.2f} | {one:.2f} |")
    return lines


def other_robots_reliability(results: Mapping[str, Any]) -> list[str]:
    """How often effects were there, by the range of the probability that was said: a reliability diagram."""
    said = [each for row in results["sets"] for each in findings(row) if each.probability >= LEAST]
    lines = ["| probability said | effects | mean of it | share that was there | a case of it, or alike |"]
    lines.append("|---|---|---|---|---|")
    for each in reliability([s.probability for s in said], [s.is_right for s in said]):
        there = share([True] * round(each.right * each.pairs) + [False] * round((1.0 - each.right) * each.pairs))
        inside = [s for s in said if each.low <= s.probability < each.high or s.probability == each.high == 1.0]
        cells = (each.pairs, f"{each.said:.2f}", there, sum(s.is_substitute for s in inside))
        lines.append(f"| {each.low:.1f}-{each.high:.1f} | {' | '.join(map(str, cells))} |")
    return lines
