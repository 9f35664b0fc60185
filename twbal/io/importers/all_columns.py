"""All columns of a log, whatever their format, for whoever sees it for the first time."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from twbal.core.errors import LogError
from twbal.core.gaussian import Array
from twbal.io.importers.arrays import left_out, named_arrays
from twbal.io.importers.column_names import Meaning, meaning_of, names_in_comments
from twbal.io.importers.fields import MISSING, is_time
from twbal.io.importers.formats import reader_of
from twbal.io.importers.text_files import read_text
from twbal.io.importers.text_layout import check_names, fields_of, layout_of
from twbal.io.importers.text_lines import text_of

_SHOWN = 5
_ODD = 0.01  # share of the fields of a column of numbers that are none, at most


class Column(NamedTuple):
    """One column of a log.

    Attributes:
        source: how a mapping names it, as yaml: by name, or by number where the file has no header.
        name: from the header or from comments; "" without one.
        meaning: of the name.
        values: (n,); NaN where a field is no number.
    """

    source: str
    name: str
    meaning: Meaning
    values: Array


def all_columns(path: Path) -> list[Column]:
    """All columns of a log.

    Raises:
        LogError: it cannot be read.
    """
    if reader_of(path) is not None:
        arrays = named_arrays(path)
        return _columns(list(arrays), list(arrays), list(arrays.values()))
    layout = layout_of(path, text_of(path))
    check_names(path, layout)
    numbers = [k for k in range(layout.width) if _is_of_numbers([row[k] for row in layout.sample])]
    if not numbers:
        raise LogError(
            f"{path} has no column in which all fields are numbers. Are there lines of text before its header, or does "
            "the header come again further down? Begin such lines with # or remove them."
        )
    read = read_text(path, [k + 1 for k in numbers])
    values = np.full((len(read.values), layout.width), np.nan)
    values[:, numbers] = read.values
    if layout.names:
        return _columns(layout.names, layout.names, list(values.T), layout.units)
    fields = [fields_of(line, layout.delimiter) for line in layout.comments]
    return _columns([], names_in_comments(layout.comments, fields, layout.width), list(values.T))


def _columns(
    header: Sequence[str], names: Sequence[str], values: Sequence[Array], units: Sequence[str] = ()
) -> list[Column]:
    found = []
    units_by_column = dict(enumerate(units))
    for k, (name, column) in enumerate(zip(names, values, strict=False)):
        plain = list(header).count(name) == 1 and name and "${" not in name  # which Hydra would fill in
        source = json.dumps(name, ensure_ascii=False) if plain else str(k + 1)
        unit = units_by_column.get(k, "").strip("[]() ")
        found.append(Column(source, name, meaning_of(f"{name} [{unit}]" if unit else name), column))
    return found


def _is_of_numbers(fields: Sequence[str]) -> bool:
    """Whether fields are numbers or times of day, but for a few that say that one is missing, or are torn."""
    there = [field for field in fields if field.lower() not in MISSING]
    hexadecimal = any(field[:2].lower() == "0x" for field in there)
    odd = sum(not (_plain(field) or is_time(field)) for field in there)
    return not hexadecimal and odd <= _ODD * len(there)


def _plain(field: str) -> bool:
    """Whether a field is a number that is not hexadecimal."""
    try:
        float(field.replace(",", "."))
    except ValueError:
        return False
    return "_" not in field


def passed_over(path: Path) -> list[str]:
    """Lines on columns that `all_columns` leaves out, as they are text, or have another number of values than most.

    Raises:
        LogError: the log cannot be read.
    """
    if reader_of(path) is None:
        return []
    return [f"   -  {name:24} passed over: {why}" for name, why in left_out(path).items()]


def row_of(number: int, column: Column) -> str:
    """A line on a column: its number, name, smallest, largest and first values."""
    values = column.values
    if not np.isfinite(values).any():
        return f"{number:4d}  {column.name:24} no numbers"
    first = ", ".join(f"{value:.6g}" for value in values[:_SHOWN])
    return f"{number:4d}  {column.name:24} {np.nanmin(values):12.6g} to {np.nanmax(values):12.6g}   {first}, ..."
