"""What a setting can be: which values a kind takes, how that is said in words, and a row of the table of settings."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

LONGEST_TEXT = 4096  # characters, which is also the longest path


class Kind(ABC):
    """Of a value, as yaml and the command line read it.

    Attributes:
        unit: of its numbers; "" where they are plain numbers, or where there are none.
        range: which values there are, without the unit: short, for tables.
        expected: which values there are, for messages.
    """

    unit: str = ""
    range: str = ""
    expected: str = ""

    @abstractmethod
    def takes(self, value: Any) -> bool:
        """Whether a setting may have this value."""


@dataclass(frozen=True)
class Number(Kind):
    """A finite number from `low` to `high`, both of which may be taken; whole numbers are numbers too."""

    low: float
    high: float
    unit: str = ""

    _types = (int, float)
    _name = "a number"

    def takes(self, value: Any) -> bool:
        """True and false are no numbers."""
        return isinstance(value, self._types) and not isinstance(value, bool) and self.low <= value <= self.high

    @property
    def range(self) -> str:  # type: ignore[override]
        """As `0.5 to 20`."""
        return f"{figure(self.low)} to {figure(self.high)}"

    @property
    def expected(self) -> str:  # type: ignore[override]
        """As `a number from 0.5 to 20 [kg]`."""
        return f"{self._name} from {self.range}" + (f" [{self.unit}]" if self.unit else "")


@dataclass(frozen=True)
class Whole(Number):
    """A whole number from `low` to `high`, both of which may be taken; 3.0 is none."""

    _types = (int,)  # type: ignore[assignment]
    _name = "a whole number"


@dataclass(frozen=True)
class Below(Number):
    """A finite number from `low`, which may be taken, to `high`, which may not."""

    def takes(self, value: Any) -> bool:
        """Less than `high`."""
        return super().takes(value) and value < self.high

    @property
    def range(self) -> str:  # type: ignore[override]
        """As `-1 to below 1`."""
        return f"{figure(self.low)} to below {figure(self.high)}"


@dataclass(frozen=True)
class YesNo(Kind):
    """True or false; 0, 1, `yes` and `no` are neither."""

    range = "true, false"
    expected = "true or false"

    def takes(self, value: Any) -> bool:
        """The two."""
        return isinstance(value, bool)


@dataclass(frozen=True)
class OneOf(Kind):
    """One of a few words."""

    words: tuple[str, ...]

    def takes(self, value: Any) -> bool:
        """One of them as it is written."""
        return isinstance(value, str) and value in self.words

    @property
    def range(self) -> str:  # type: ignore[override]
        """All of them."""
        return ", ".join(self.words)

    @property
    def expected(self) -> str:  # type: ignore[override]
        """All of them."""
        return f"one of: {self.range}"


@dataclass(frozen=True)
class Text(Kind):
    """Some text.

    Attributes:
        range: what it is.
    """

    range: str = "text"

    def takes(self, value: Any) -> bool:
        """Not empty, and fit for a path."""
        return isinstance(value, str) and 0 < len(value) <= LONGEST_TEXT and "\0" not in value

    @property
    def expected(self) -> str:  # type: ignore[override]
        """What it is."""
        return f"{self.range}, not empty"


@dataclass(frozen=True)
class ListOf(Kind):
    """A list of values of one kind.

    Attributes:
        kind: of each.
        least: how many there must be.
        most: how many there may be.
    """

    kind: Kind
    least: int = 0
    most: int = 10_000

    @property
    def unit(self) -> str:  # type: ignore[override]
        """That of its values."""
        return self.kind.unit

    def takes(self, value: Any) -> bool:
        """All of its values, and as many."""
        return isinstance(value, list) and self.least <= len(value) <= self.most and all(map(self.kind.takes, value))

    @property
    def range(self) -> str:  # type: ignore[override]
        """As `[0 to 1]`."""
        return f"[{self.kind.range}]"

    @property
    def expected(self) -> str:  # type: ignore[override]
        """As `a list of 2, each a number from 0 to 1`."""
        count = str(self.least) if self.least == self.most else f"{self.least} or more"
        return f"a list of {count}, each {self.kind.expected}"


@dataclass(frozen=True)
class Span(Kind):
    """Two numbers, the lowest and the highest of a range that is drawn from."""

    number: Number

    @property
    def unit(self) -> str:  # type: ignore[override]
        """That of both."""
        return self.number.unit

    def takes(self, value: Any) -> bool:
        """Both, in order; they may be the same."""
        is_pair = isinstance(value, list) and len(value) == 2 and all(map(self.number.takes, value))
        return is_pair and value[0] <= value[1]

    @property
    def range(self) -> str:  # type: ignore[override]
        """As `[low, high] of 0 to 1`."""
        return f"[low, high] in {self.number.range}"

    @property
    def expected(self) -> str:  # type: ignore[override]
        """As `[lowest, highest], each a number from 0 to 1`."""
        return f"[lowest, highest], in order, each {self.number.expected}"


@dataclass(frozen=True)
class Either(Kind):
    """A value of one kind or of another.

    Attributes:
        first, second: the kinds.
        range: of both.
    """

    first: Kind
    second: Kind
    range: str

    def takes(self, value: Any) -> bool:
        """What one of them takes."""
        return self.first.takes(value) or self.second.takes(value)

    @property
    def expected(self) -> str:  # type: ignore[override]
        """Both."""
        return f"{self.first.expected}; or {self.second.expected}"


@dataclass(frozen=True)
class OrNull(Kind):
    """A value of a kind, or null."""

    kind: Kind

    @property
    def unit(self) -> str:  # type: ignore[override]
        """That of the kind."""
        return self.kind.unit

    def takes(self, value: Any) -> bool:
        """Null, too."""
        return value is None or self.kind.takes(value)

    @property
    def range(self) -> str:  # type: ignore[override]
        """Null, too."""
        return f"null or {self.kind.range}"

    @property
    def expected(self) -> str:  # type: ignore[override]
        """Null, too."""
        return f"null or {self.kind.expected}"


@dataclass(frozen=True)
class Part(Kind):
    """Settings of its own, under this one."""

    range = "settings"
    expected = "settings of its own"

    def takes(self, value: Any) -> bool:
        """A mapping."""
        return isinstance(value, Mapping)


_LARGEST_ANSWER = 1e6  # of a robot, in any unit


@dataclass(frozen=True)
class SheetAnswer(Kind):
    """An answer to `twbal new-robot`, or null. What it says is looked at there, question by question."""

    unit: str = ""
    range = "answer"
    expected = "null, a number, or text such as `1090 g measured`"

    def takes(self, value: Any) -> bool:
        """Numbers and texts."""
        is_text = isinstance(value, str) and 0 < len(value) <= LONGEST_TEXT
        return value is None or is_text or Number(-_LARGEST_ANSWER, _LARGEST_ANSWER).takes(value)


class Setting(NamedTuple):
    """What is known of one setting.

    Attributes:
        key: dotted, as on the command line; `*` stands for a name that is free.
        kind: which values it can have, and their unit.
        meaning: in a few words, without the unit.
        common: whether it is one of those that are changed most.
    """

    key: str
    kind: Kind
    meaning: str
    common: bool = False


PATH = Text("path")
PATHS = Either(PATH, ListOf(PATH, least=1), "path or [path,...]")
BASES = OrNull(Either(PATH, ListOf(OrNull(PATH), least=1), "path or [path,...]"))
PATHS_OR_NONE = Either(PATH, ListOf(PATH), "path, [path,...] or []")


def names_files(kind: Kind) -> bool:
    """Whether what a setting says are paths."""
    return kind in (PATH, OrNull(PATH), PATHS, PATHS_OR_NONE, BASES)


def holds_settings(kind: Kind) -> bool:
    """Whether there are settings under this one."""
    return kind in (Part(), OrNull(Part()))


def figure(value: float) -> str:
    """A bound as short as it can be said without loss: 10000, 1e6, 4294967295."""
    short = f"{value:g}".replace("e-0", "e-").replace("e+0", "e").replace("e+", "e")
    whole = str(int(value)) if value == int(value) and abs(value) < 1e12 else short
    return whole if len(whole) <= 5 or float(short) != value else short
