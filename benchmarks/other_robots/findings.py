"""What a diagnosis said of a set, by whether it is there, from the record of the set."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from benchmarks.other_robots.kinds import equivalents
from benchmarks.other_robots.score import CLASSES, PRESLIDING, TILT_FILTER, class_of, presliding_of

EASY = (PRESLIDING, TILT_FILTER)
"""Effects that are there without being hidden, and that are easy to find."""
NAMED, WRONG = 0.9, 0.8
"""Probabilities from which on, and above which, an effect counts as named, and as said wrongly."""
_FILTERED = ("real", "tilt filter")  # qualities of the sensors whose tilt comes from a filter


class Finding(NamedTuple):
    """An effect with its probability.

    Attributes:
        name: of the effect.
        probability: that was given to it.
        is_right: it is there, or a declared equivalent is, or another value of the same class of the data sheet.
        is_false: it is not there, nor is one of which it is a case, or from which these data cannot tell it.
    """

    name: str
    probability: float
    is_right: bool
    is_false: bool

    @property
    def is_substitute(self) -> bool:
        """Whether it is only a case of what is there, or one that these data cannot tell from it."""
        return not self.is_right and not self.is_false

    def is_likely_false(self, least: float) -> bool:
        """Whether it is false and has at least some probability."""
        return self.is_false and self.probability >= least

    @property
    def is_easy(self) -> bool:
        """Whether it is one of those that are easy to find."""
        return self.name in EASY


def findings(row: Mapping[str, Any]) -> list[Finding]:
    """All that was said of a set."""
    there = {*row["hidden"], *presliding_of(row["hidden"])}
    if row["sensors"] in _FILTERED:
        there.add(TILT_FILTER)
    return [
        Finding(s["name"], s["probability"], s["right"] and bool(_meant(s["name"]) & there), not s["right"])
        for s in row["said"]
    ]


def probabilities(row: Mapping[str, Any]) -> dict[str, float]:
    """By hidden effect, the largest probability of it or of a declared equivalent (0: nothing was said).

    A verdict that names the class of a value of the data sheet counts as 1.
    """
    found = {}
    for name, recorded in row["hidden"].items():
        is_class = row["verdict"] == "data_sheet" and recorded == 1.0 and any(name in names for _, names in CLASSES)
        own = [s["probability"] for s in row["said"] if _meant(s["name"]) & class_of(name)]
        found[name] = 1.0 if is_class else max(own, default=0.0)
    return found


def sure_findings(rows: Iterable[Mapping[str, Any]]) -> list[Finding]:
    """All that is named in some sets."""
    return [each for row in rows for each in findings(row) if each.probability >= NAMED]


def is_wrong(row: Mapping[str, Any]) -> bool:
    """Whether something false has a probability above 0.8."""
    return any(each.is_likely_false(WRONG + 1e-9) for each in findings(row))


def is_diagnosed(row: Mapping[str, Any]) -> bool:
    """Whether there is a diagnosis; there is none where the recording was refused."""
    return bool(row["verdict"] != "no diagnosis")


def _meant(name: str) -> set[str]:
    return {other for each in equivalents(name) for other in class_of(each)}
