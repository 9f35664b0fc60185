"""Values out of a checkpoint's payload, each checked where it is read, before anything is computed from it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from twbal.core.errors import CheckpointError
from twbal.core.gaussian import Array

_ANY = -1
"""As a length: whatever is found, one at least."""


@dataclass(frozen=True)
class Payload:
    """What a checkpoint says of one thing.

    Attributes:
        what: the thing, as messages name it ("policy").
        values: by name.

    Raises:
        CheckpointError: by each method, where the value is missing or is not what it must be.
    """

    what: str
    values: Any  # whatever the file says; every method first looks whether it is a mapping

    def __getitem__(self, name: str) -> Any:
        if name not in self.names:
            raise CheckpointError(
                f"The {self.what}'s checkpoint has no {name!r}; it has: {', '.join(self.names)[:200]}."
            )
        return self.values[name]

    @property
    def names(self) -> tuple[str, ...]:
        """Of all values."""
        if not isinstance(self.values, Mapping):
            kind = type(self.values).__name__
            raise CheckpointError(f"The {self.what} must be values by their names; found a {kind}.")
        return tuple(map(str, self.values))

    def part(self, name: str) -> "Payload":
        """What is within `name`."""
        return Payload(f"{self.what}'s {name}", self[name])

    def numbers(self, name: str, shape: tuple[int, ...], low: float = -np.inf, high: float = np.inf) -> Array:
        """Finite numbers within [low, high].

        Args:
            name: of the array.
            shape: that it must have; -1 stands for any length but zero.
            low: the lowest that each may be.
            high: the highest.
        """
        values = self[name]
        found = values.shape if isinstance(values, np.ndarray) else type(values).__name__
        if not isinstance(values, np.ndarray) or values.dtype.kind not in "fiub" or not _fits(values.shape, shape):
            wanted = ", ".join("any" if length == _ANY else str(length) for length in shape)
            raise CheckpointError(f"The {self.what}'s {name} must be numbers of shape ({wanted}); found {found}.")
        numbers = np.ascontiguousarray(values, dtype=np.float64)
        good = np.isfinite(numbers) & (numbers >= low) & (numbers <= high)
        if not good.all():
            raise CheckpointError(self._out_of_range(name, float(numbers[~good][0]), low, high))
        return numbers

    def number(self, name: str, low: float = -np.inf, high: float = np.inf) -> float:
        """A number within [low, high]; not a NaN."""
        value = self[name]
        if isinstance(value, np.ndarray) and value.shape == ():
            value = value.item()
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise CheckpointError(f"The {self.what}'s {name} must be a number; found a {type(value).__name__}.")
        try:
            number = float(value)
        except OverflowError:
            number = np.inf if value > 0 else -np.inf
        if not low <= number <= high:
            raise CheckpointError(self._out_of_range(name, number, low, high))
        return number

    def flag(self, name: str) -> bool:
        """True or false."""
        return bool(self._of(name, bool))

    def text(self, name: str) -> str:
        """A text."""
        return str(self._of(name, str))

    def texts(self, name: str) -> tuple[str, ...]:
        """A list of texts."""
        values = self.items(name)
        if not all(isinstance(value, str) for value in values):
            raise CheckpointError(f"The {self.what}'s {name} must be texts; found {str(values)[:80]}.")
        return values

    def items(self, name: str) -> tuple[Any, ...]:
        """A list of whatever."""
        return tuple(self._of(name, list, tuple))

    def _of(self, name: str, *kinds: type) -> Any:
        value = self[name]
        if type(value) not in kinds:
            raise CheckpointError(
                f"The {self.what}'s {name} must be a {kinds[0].__name__}; found a {type(value).__name__}."
            )
        return value

    def _out_of_range(self, name: str, found: float, low: float, high: float) -> str:
        within = f"within [{low:g}, {high:g}]" if low > -np.inf or high < np.inf else "finite"
        return f"The {self.what}'s {name} must be {within}; found {found:.6g}. Was the file changed? Make it again."


def _fits(found: tuple[int, ...], wanted: tuple[int, ...]) -> bool:
    if len(found) != len(wanted):
        return False
    return all(have > 0 if want == _ANY else have == want for have, want in zip(found, wanted, strict=True))
