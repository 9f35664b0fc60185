"""Files that are no text of columns (`formats/`), as columns."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from twbal.core.errors import LogError, printable
from twbal.core.gaussian import Array
from twbal.io.importers.columns import Columns, Name, places
from twbal.io.importers.fields import seconds_of, seconds_since_first
from twbal.io.importers.formats import reader_of


def named_arrays(path: Path) -> dict[str, Array]:
    """The columns of such a file by name: (n,) each, all of the length that most numbers have.

    A matrix `data` gives the columns `data:1`, `data:2`, ...; a structure or object `log`
    with a field `tilt` gives `log.tilt`.

    Raises:
        LogError: the file cannot be read, or has no columns.
    """
    return _of_one_length(_all_arrays(path))


def other_lengths(path: Path) -> dict[str, int]:
    """How many values those columns of such a file have that `named_arrays` passes over, by name.

    Raises:
        LogError: the file cannot be read, or has no columns.
    """
    every = _all_arrays(path)
    found = _of_one_length(every)
    return {name: len(values) for name, values in every.items() if name not in found}


def _of_one_length(found: dict[str, Array]) -> dict[str, Array]:
    """The columns of the length that most numbers have."""
    lengths = [len(values) for values in found.values()]
    common = max(set(lengths), key=lambda length: length * lengths.count(length))
    return {name: values for name, values in found.items() if len(values) == common}


def _all_arrays(path: Path) -> dict[str, Array]:
    """The columns of such a file by name, of whatever length.

    Raises:
        LogError: the file cannot be read, or has no columns.
    """
    read = reader_of(path)
    assert read is not None
    try:
        found = dict(_columns("", read(path)))
    except LogError:
        raise
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror or error}.") from error
    except Exception as error:  # what readers raise at a damaged file is anything
        raise LogError(f"{path} cannot be read as a {path.suffix} file ({error}).") from error
    if not found:
        raise LogError(f"{path} has no vector or matrix of numbers.")
    return {printable(name): values for name, values in found.items()}


def read_arrays(path: Path, wanted: Sequence[Name], names: Sequence[str] = ()) -> Columns:
    """Columns of such a file; arguments as of `text_files.read_text`.

    Raises:
        LogError: the file cannot be read, or has no such column, or one of another length than the others.
    """
    every = _all_arrays(path)
    found = _of_one_length(every)
    _check_lengths(path, wanted, every, found)
    known = list(names) if names and len(names) == len(found) else list(found)
    where = places(path, known, len(found), wanted)
    columns = list(found.values())
    values = np.column_stack([columns[k] for k in where])
    numbers = np.arange(len(values))
    return Columns(values, numbers + 1, numbers, "row", ())


def _check_lengths(path: Path, wanted: Sequence[Name], every: dict[str, Array], found: dict[str, Array]) -> None:
    """Check that no wanted column has another length than most.

    Args:
        path: of the file, for errors.
        wanted: columns by name or number.
        every: all columns of the file.
        found: those of the length that most have.

    Raises:
        LogError: one has.
    """
    for name in wanted:
        if name in every and name not in found:
            first, values = next(iter(found.items()))
            raise LogError(
                f"The columns of {path} have unequal lengths: {name!r} has {len(every[name])} values, and {first!r} "
                f"has {len(values)}. Expected is one value for each row: write the file anew, with null or NaN where "
                "a value is missing."
            )


def _array(value: Any) -> Array:
    """An array, in which empty entries of a list (null, "") are NaN, and times of day are seconds from the first."""
    if isinstance(value, list | tuple) and value and isinstance(value[0], str):
        fields = ["" if item is None else item for item in value]
        if all(isinstance(item, str) for item in fields) and (seconds := seconds_of(fields)) is not None:
            return seconds
    if isinstance(value, list) and any(item is None or item == "" for item in value):
        value = [np.nan if item is None or item == "" else item for item in value]
    array = np.asarray(value)
    return seconds_since_first(array) if array.dtype.kind == "M" and array.ndim == 1 and len(array) else array


def _columns(prefix: str, tree: Mapping[str, Any]) -> list[tuple[str, Array]]:
    found: list[tuple[str, Array]] = []
    for name, value in tree.items():
        if hasattr(value, "_fieldnames"):  # a MATLAB structure
            value = {field: getattr(value, field) for field in value._fieldnames}
        if isinstance(value, Mapping):
            found += _columns(f"{prefix}{name}.", value)
            continue
        array = _array(value)
        if array.dtype.kind not in "fiub" or array.ndim not in (1, 2):
            continue
        if array.ndim == 1:
            found.append((prefix + name, array.astype(np.float64)))
        else:
            tall = array if array.shape[0] >= array.shape[1] else array.T
            found += [(f"{prefix}{name}:{k + 1}", tall[:, k].astype(np.float64)) for k in range(tall.shape[1])]
    return found
