"""Files that are no text of columns (`formats/`), as columns."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twbal.core.errors import LogError, printable
from twbal.core.gaussian import Array
from twbal.io.importers.columns import Columns, Name, places
from twbal.io.importers.entries import Entries, entries_of
from twbal.io.importers.fields import seconds_since_first
from twbal.io.importers.formats import reader_of

_KINDS = "fiubMUSO"  # of NumPy: numbers, instants, texts and objects


class _Content(NamedTuple):
    """What such a file has.

    Attributes:
        columns: of numbers by name, of whatever length.
        texts: columns of entries of which too many are no numbers, by name.
    """

    columns: dict[str, Entries]
    texts: dict[str, Entries]

    @property
    def of_one_length(self) -> dict[str, Entries]:
        """The columns of the length that most numbers have."""
        lengths = [len(column.numbers) for column in self.columns.values()]
        common = max(set(lengths), key=lambda length: length * lengths.count(length))
        return {name: column for name, column in self.columns.items() if len(column.numbers) == common}


def named_arrays(path: Path) -> dict[str, Array]:
    """The columns of such a file by name: (n,) each, all of the length that most numbers have.

    A matrix `data` gives the columns `data:1`, `data:2`, ...; a structure or object `log`
    with a field `tilt` gives `log.tilt`. Texts of numbers are numbers.

    Raises:
        LogError: the file cannot be read, or has no columns.
    """
    return {name: column.numbers for name, column in _content(path).of_one_length.items()}


def left_out(path: Path) -> dict[str, str]:
    """Why `named_arrays` passes over columns of such a file, by name.

    A single value is a parameter, and no column.

    Raises:
        LogError: the file cannot be read, or has no columns.
    """
    content = _content(path)
    found = content.of_one_length
    why = {
        name: f"it has {len(column.numbers)} values, which is not one a row"
        for name, column in content.columns.items()
        if name not in found and len(column.numbers) > 1
    }
    for name, text in content.texts.items():
        if len(text.numbers) > 1:
            why[name] = f"its entries are no numbers, such as {text.word} in entry {text.place}"
    return why


def _content(path: Path) -> _Content:
    """The columns of such a file.

    Raises:
        LogError: the file cannot be read, or has no columns.
    """
    read = reader_of(path)
    assert read is not None
    try:
        found = [(printable(name), column) for name, column in _columns("", read(path))]
    except LogError:
        raise
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror or error}.") from error
    except Exception as error:  # what readers raise at a damaged file is anything
        raise LogError(f"{path} cannot be read as a {path.suffix} file ({error}).") from error
    content = _Content(
        {name: column for name, column in found if not column.is_text},
        {name: column for name, column in found if column.is_text},
    )
    if not content.columns:
        name, text = next(iter(content.texts.items()), ("", None))
        why = f": entry {text.place} of column {name!r} is {text.word}" if text else ""
        raise LogError(f"{path} has no vector or matrix of numbers{why}.")
    return content


def read_arrays(path: Path, wanted: Sequence[Name], names: Sequence[str] = (), unsaid: Collection[str] = ()) -> Columns:
    """Columns of such a file; arguments as of `text_files.read_text`.

    Raises:
        LogError: the file cannot be read, or has no such column, or one of text, or one of another length than the
            others.
    """
    content = _content(path)
    found = content.of_one_length
    _check_wanted(path, wanted, content, found)
    known = list(names) if names and len(names) == len(found) else list(found)
    where = places(path, known, len(found), wanted, unsaid)
    columns = list(found.items())
    values = np.column_stack([columns[k][1].numbers for k in where])
    numbers = np.arange(len(values))
    notes = [columns[k][1].note(columns[k][0]) for k in dict.fromkeys(where) if columns[k][1].odd]
    return Columns(values, numbers + 1, numbers, "row", tuple(notes))


def _check_wanted(path: Path, wanted: Sequence[Name], content: _Content, found: Mapping[str, Entries]) -> None:
    """Check that no wanted column is text, or has another length than most.

    Args:
        path: of the file, for errors.
        wanted: columns by name or number.
        content: of the file.
        found: its columns of the length that most have.

    Raises:
        LogError: one is, or has.
    """
    for name in wanted:
        if name in content.texts and name not in content.columns:
            text = content.texts[str(name)]
            raise LogError(
                f"The column {name!r} of {path} is there, but entry {text.place} is {text.word}, no number, as are "
                f"{text.odd} of its {len(text.numbers)} entries: write numbers, with null where one is missing."
            )
        if name in content.columns and name not in found:
            first, column = next(iter(found.items()))
            count = len(content.columns[str(name)].numbers)
            raise LogError(
                f"The columns of {path} have unequal lengths: {name!r} has {count} values, and {first!r} has "
                f"{len(column.numbers)}. Expected is one value for each row: write the file anew, with null or NaN "
                "where a value is missing."
            )


def _columns(prefix: str, tree: Mapping[str, Any]) -> Iterator[tuple[str, Entries]]:
    """All columns of a tree, by the names on the way to them."""
    for name, value in tree.items():
        if hasattr(value, "_fieldnames"):  # a MATLAB structure
            value = {field: getattr(value, field) for field in value._fieldnames}
        if isinstance(value, Mapping):
            yield from _columns(f"{prefix}{name}.", value)
            continue
        array = np.asarray(value)
        if array.dtype.kind in "UO":
            array = np.asarray(value, dtype=object)  # as it was, without numbers that became texts
        if array.ndim == 1:
            columns = [(prefix + name, array)]
        elif array.ndim == 2:
            tall = array if array.shape[0] >= array.shape[1] else array.T
            columns = [(f"{prefix}{name}:{k + 1}", tall[:, k]) for k in range(tall.shape[1])]
        else:
            continue
        for each, items in columns:
            if items.dtype.kind in _KINDS:
                yield each, _entries(items)


def _entries(items: NDArray[Any]) -> Entries:
    """A column's entries, (n,), as numbers; instants as seconds from the first."""
    if items.dtype.kind == "M":
        return Entries(seconds_since_first(items) if len(items) else np.zeros(0))
    return entries_of(items) if items.dtype.kind in "USO" else Entries(items.astype(np.float64))
