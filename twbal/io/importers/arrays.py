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
    lengths = [len(values) for values in found.values()]
    common = max(set(lengths), key=lambda length: length * lengths.count(length))
    return {printable(name): values for name, values in found.items() if len(values) == common}


def read_arrays(path: Path, wanted: Sequence[Name], names: Sequence[str] = ()) -> Columns:
    """Columns of such a file; arguments as of `text_files.read_text`.

    Raises:
        LogError: the file cannot be read, or has no such column.
    """
    found = named_arrays(path)
    known = list(names) if names and len(names) == len(found) else list(found)
    where = places(path, known, len(found), wanted)
    columns = list(found.values())
    values = np.column_stack([columns[k] for k in where])
    numbers = np.arange(len(values))
    return Columns(values, numbers + 1, numbers, "row", ())


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
