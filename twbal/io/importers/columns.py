"""Columns of numbers out of a foreign file, whatever its format."""

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twbal.core.errors import LogError
from twbal.core.files import read_bounded
from twbal.core.gaussian import Array

Name = str | int
"""A column by its name, or by its number from 1 on."""

LARGEST = 2**32  # bytes of a file, and of all that a compressed one unfolds to


class Columns(NamedTuple):
    """What was read.

    Attributes:
        values: (n, k), in the order in which columns were asked for; NaN where a field is empty.
        lines: (n,) number of the line (of a text) or row (of arrays) that each comes from, from 1 on.
        rows: (n,) the same among rows of numbers alone, from 0 on: empty lines and comments do not count.
        row: what such a number counts, "line" or "row".
        notes: what was odd, and what was done about it.
        header_again: number of the first line that repeats the header; 0 where none does.
    """

    values: Array
    lines: NDArray[np.int64]
    rows: NDArray[np.int64]
    row: str
    notes: tuple[str, ...]
    header_again: int = 0


def file_data(path: Path) -> bytes:
    """The content of a file: never a pipe that nobody writes to, nor a device without an end.

    Raises:
        LogError: it cannot be read.
    """
    try:
        return read_bounded(path, LARGEST)
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror or error}.") from error


def places(
    path: Path, names: Sequence[str], count: int, wanted: Sequence[Name], unsaid: Collection[str] = ()
) -> list[int]:
    """Where the wanted columns are, from 0 on.

    Args:
        path: of the file, for errors.
        names: of its columns; empty where it has no header.
        count: of its columns.
        wanted: columns by name or number.
        unsaid: names that are the quantities' own, as a mapping has them that says nothing of these.

    Raises:
        LogError: the file has no such column, or several of that name.
    """
    found = []
    for name in wanted:
        if isinstance(name, int) or (name.isdigit() and name not in names):
            if not 1 <= int(name) <= count:
                raise LogError(f"{path} has {count} columns; the mapping asks for column {name}.")
            found.append(int(name) - 1)
        elif name in names:
            found.append(_place(path, list(names), name))
        else:
            known = ", ".join(names) if names else f"none by name, but numbers 1 to {count}: it has no header"
            advice = "Mend the mapping (import=...)"
            if name in unsaid:
                advice = (
                    f"The mapping does not say where {name} is: name its column; if the log has none, write "
                    f"{name}: null (++import.quantities.{name}=null)"
                )
            raise LogError(
                f"{path} has no column {name!r}; it has: {known}. {advice}, or have one proposed by `twbal import-log "
                "guess=true`."
            )
    return found


def _place(path: Path, names: list[str], name: str) -> int:
    """Where the column of a name is, from 0 on."""
    numbers = [k for k, each in enumerate(names, start=1) if each == name]
    if len(numbers) > 1:
        listed = " and ".join(map(str, numbers))
        raise LogError(
            f"{path} has {len(numbers)} columns named {name!r}, numbers {listed}; the mapping does not say which one "
            f"is meant. Map it by its number, as in {{from: {numbers[0]}}}."
        )
    return numbers[0] - 1
