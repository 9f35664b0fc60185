"""What a check of a computer or of a robot came to, and how a list of them is told."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple


class CheckStatus(StrEnum):
    """What a check says."""

    OK = "ok"
    WARNING = "warning"  # it may work, and less well
    PROBLEM = "problem"  # it will not work, or not safely
    SKIPPED = "skipped"  # not looked at: nothing is known


class Measurement(NamedTuple):
    """A number that a check came by.

    Attributes:
        name: of the quantity.
        value: in the unit.
        unit: of SI.
    """

    name: str
    value: float
    unit: str


@dataclass(frozen=True)
class Check:
    """One thing that was looked at.

    Attributes:
        name: of the thing.
        verdict: what it comes to.
        found: as a phrase, with units.
        expected: as a phrase; empty where `found` says it.
        advice: what to do, as a sentence; empty where nothing is to be done.
        measured: the numbers in `found` that others may want.
    """

    name: str
    verdict: CheckStatus
    found: str
    expected: str = ""
    advice: str = ""
    measured: tuple[Measurement, ...] = ()

    def line(self, width: int) -> str:
        """All of it in one line, with the name in a column of `width` characters."""
        expected = f" (expected {self.expected})" if self.expected and self.verdict is not CheckStatus.OK else ""
        said = f"{self.verdict:8} {self.name:{width}}  {self.found}{expected}"
        ends = " " if said.endswith(("?", "!")) else ". "
        return f"{said}{ends}{self.advice}" if self.advice else said


def check_lines(checks: Sequence[Check]) -> Iterator[str]:
    """A line of each."""
    width = max((len(check.name) for check in checks), default=0)
    yield from (check.line(width) for check in checks)


def skipped(checks: Iterable[Check]) -> list[str]:
    """Names of those that were not looked at."""
    return [check.name for check in checks if check.verdict is CheckStatus.SKIPPED]


def problems(checks: Iterable[Check]) -> list[str]:
    """Names of those that are a problem."""
    return [check.name for check in checks if check.verdict is CheckStatus.PROBLEM]
