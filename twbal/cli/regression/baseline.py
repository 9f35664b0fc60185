"""Measures beside those of a baseline: what moved, and by more than it may."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import NamedTuple
from xml.etree import ElementTree

from twbal.core.errors import ConfigError


@dataclass(frozen=True)
class Tolerance:
    """By how much a measure may move.

    Attributes:
        pattern: of the names that it is for, with * and ?.
        relative: share of the baseline's value.
        absolute: in the measure's unit; the two add up.
    """

    pattern: str
    relative: float
    absolute: float

    def __post_init__(self) -> None:
        if not (0 <= self.relative < math.inf and 0 <= self.absolute < math.inf):
            raise ConfigError(f"The tolerance of {self.pattern!r} must be finite and not negative; found {self}.")


class MeasureComparison(NamedTuple):
    """One measure.

    Attributes:
        name: `part/what`.
        before: in the baseline; None where it has none of that name.
        now: None where it is not measured any more.
        allowed: by how much it may move; 0 for words.
        moved: whether it moved by more.
    """

    name: str
    before: float | str | None
    now: float | str | None
    allowed: float
    moved: bool

    @property
    def words(self) -> str:
        """What happened, on one line."""
        if self.before is None or self.now is None:
            return "not in the baseline" if self.before is None else "gone"
        if isinstance(self.before, str) or isinstance(self.now, str):
            return f"{self.before!r} -> {self.now!r}"
        by = abs(self.now - self.before)
        return f"{self.before:.6g} -> {self.now:.6g} (moved by {by:.2g}, allowed {self.allowed:.2g})"


def compare(
    before: Mapping[str, float | str], now: Mapping[str, float | str], tolerances: Sequence[Tolerance]
) -> list[MeasureComparison]:
    """All measures of both, by name; of several tolerances that fit a name the last one counts.

    Raises:
        ConfigError: no tolerance fits a name.
    """
    return [_compared(name, before.get(name), now.get(name), tolerances) for name in sorted({*before, *now})]


def _compared(
    name: str, before: float | str | None, now: float | str | None, tolerances: Sequence[Tolerance]
) -> MeasureComparison:
    if before is None or now is None or isinstance(before, str) or isinstance(now, str):
        return MeasureComparison(name, before, now, 0.0, before != now)
    fitting = [tolerance for tolerance in tolerances if fnmatchcase(name, tolerance.pattern)]
    if not fitting:
        raise ConfigError(f"No tolerance fits the measure {name!r}. Add one with pattern '*' to the tolerances.")
    allowed = fitting[-1].relative * abs(before) + fitting[-1].absolute
    return MeasureComparison(name, before, now, allowed, not abs(now - before) <= allowed)  # NaN has moved


def updated(compared: Sequence[MeasureComparison]) -> dict[str, float | str]:
    """The measures of the next baseline: those that moved as they are now, the others with the digits that they had."""
    found: dict[str, float | str] = {}
    for each in compared:
        value = each.before if not each.moved else each.now
        if value is not None:  # None: it is not measured any more
            found[each.name] = value
    return found


def table(compared: Sequence[MeasureComparison]) -> str:
    """What moved, measure by measure, and how many of each part stayed."""
    moved = [each for each in compared if each.moved]
    width = max((len(each.name) for each in moved), default=0)
    lines = [f"  {each.name:{width}}  {each.words}" for each in moved]
    parts: dict[str, list[bool]] = {}
    for each in compared:
        parts.setdefault(each.name.split("/")[0], []).append(each.moved)
    lines += [f"{part:10} {len(all_) - sum(all_)} of {len(all_)} as in the baseline" for part, all_ in parts.items()]
    return "\n".join(lines)


def junit(compared: Sequence[MeasureComparison]) -> str:
    """The comparison as JUnit XML: a suite for each part, a case for each measure."""
    whole = ElementTree.Element("testsuites", name="twbal regress")
    suites: dict[str, ElementTree.Element] = {}
    for each in compared:
        part, _, what = each.name.partition("/")
        if part not in suites:
            suites[part] = ElementTree.SubElement(whole, "testsuite", name=part)
        case = ElementTree.SubElement(suites[part], "testcase", classname=f"twbal.regress.{part}", name=what)
        if each.moved:
            ElementTree.SubElement(case, "failure", message=each.words)
    for suite in suites.values():
        suite.set("tests", str(len(suite)))
        suite.set("failures", str(len(suite.findall("testcase/failure"))))
    ElementTree.indent(whole)
    return ElementTree.tostring(whole, encoding="unicode", xml_declaration=True) + "\n"
