"""Text files of columns: commas, semicolons, tabs or blanks between them, comments, a header or none."""

import io
import re
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas
from numpy.typing import NDArray

from twbal.core.errors import LogError
from twbal.core.gaussian import Array
from twbal.core.text import counted
from twbal.io.importers.columns import Columns, Name, places
from twbal.io.importers.fields import MISSING, is_number, seconds_of
from twbal.io.importers.repeated_header import repeated_headers
from twbal.io.importers.text_layout import (
    BLANKS,
    COMMENTS,
    DELIMITERS,
    LOOKED_AT,
    TextLayout,
    check_names,
    decimal_commas,
    fields_of,
    layout_of,
)
from twbal.io.importers.text_lines import text_of

_TORN = 0.01  # share of the rows up to which lines that are torn, or fields that are no numbers, are left out
_BEGUN = re.compile(r"[+-]|[+-]?(\d+\.?\d*|\.\d+)[eE][+-]?")  # a number that was cut off, and none by itself
_FEWEST = 20  # rows by which a last field is judged
_SHORT = 0.05  # share of the other fields that are as short as one that was cut off, at most
_FAR = 3.0  # of the largest other step, by which such a field is off
_DAMAGED = "Was it damaged on its way, or is it two files in one? Mend or cut the file there."


class _Rows(NamedTuple):
    """Which lines of a text are rows of numbers, and which were left out; all from 0 on.

    Attributes:
        kept: rows.
        torn: lines with another number of columns.
        again: lines that repeat the header.
        cut: a last line that was cut off; none: -1.
    """

    kept: list[int]
    torn: tuple[int, ...] = ()
    again: tuple[int, ...] = ()
    cut: int = -1


def read_text(path: Path, wanted: Sequence[Name], names: Sequence[str] = (), unsaid: Collection[str] = ()) -> Columns:
    """Columns of a text file; times of day become seconds from the first.

    A last line that was cut off is left out, and so are few lines that are torn. Fields that are empty, say that a
    number is missing, or are none become NaN; the latter are an error where they are many.

    Args:
        path: of the file.
        wanted: which columns.
        names: of all columns, where the file has no header and the mapping knows them.
        unsaid: as of `columns.places`.

    Raises:
        LogError: the file cannot be read; the message says in which line and why.
    """
    text = text_of(path)
    lines, layout = text.lines, layout_of(path, text)
    if any(isinstance(name, str) and not name.isdigit() for name in wanted):
        check_names(path, layout, names)
    where = places(path, layout.names or tuple(names), layout.width, wanted, unsaid)
    rows = _rows(path, lines, layout)
    notes = [*text.notes, *_notes(rows, layout)]
    values, more = _numbers(path, [lines[row] for row in rows.kept], layout, where, rows.kept)
    again = rows.again[0] + 1 if rows.again else 0
    places_of_rows = np.array(rows.kept)
    counted = np.arange(len(places_of_rows)) + np.searchsorted(rows.torn, places_of_rows)  # a torn line was a row
    return Columns(values, places_of_rows + 1, counted, "line", (*notes, *more), again)


def _notes(rows: _Rows, layout: TextLayout) -> list[str]:
    """What was odd about the lines of a text."""
    notes = []
    if layout.before:
        notes.append(f"{counted(layout.before, 'line')} before its columns begin: left out")
    if rows.again:
        notes.append(f"its header comes again, first in line {rows.again[0] + 1}: left out")
    if rows.torn:
        what = "1 line has" if len(rows.torn) == 1 else f"{len(rows.torn)} lines have"
        notes.append(f"{what} another number of columns, first line {rows.torn[0] + 1}: left out")
    if rows.cut >= 0:
        notes.append(f"its last line ({rows.cut + 1}) is cut off and left out")
    if layout.units:
        notes.append("the row of units below its header is not used: the mapping tells the units")
    if layout.decimal == ",":
        notes.append("numbers with decimal commas were read as such")
    return notes


def _rows(path: Path, lines: Sequence[str], layout: TextLayout) -> _Rows:
    """Which lines are rows of numbers.

    Raises:
        LogError: lines before the last have another number of columns, more of them than a torn line now and then; or
            the header comes again with its names in another order.
    """
    comment = layout.comment or COMMENTS
    rows = [k for k, line in enumerate(lines) if (stripped := line.strip()) and stripped[0] not in comment]
    rows = rows[layout.before :]
    again: tuple[int, ...] = ()
    if layout.has_header:
        header, *rows = rows
        rows = rows[1:] if layout.units else rows
        again = tuple(repeated_headers(path, lines, rows, header, layout.delimiter))
        rows = [row for row in rows if row not in set(again)] if again else rows
    if not rows:
        raise LogError(f"{path} has a header and no rows.")
    if any('"' in line for line in lines):  # a delimiter in quotation marks is none
        return _Rows(rows, (), again)
    # With a delimiter at their end, lines have one field more, and it is empty.
    is_blank = layout.delimiter == BLANKS
    counts = np.array([len(lines[row].split()) if is_blank else lines[row].count(layout.delimiter) + 1 for row in rows])
    wrong: NDArray[np.int64] = np.flatnonzero(counts != layout.width)
    cut = rows[-1] if len(wrong) and wrong[-1] == len(rows) - 1 else -1
    wrong = wrong[:-1] if cut >= 0 else wrong
    decimal = decimal_commas(layout)
    if len(wrong) > _TORN * len(rows) or (len(wrong) and decimal):
        raise LogError(
            f"Line {rows[wrong[0]] + 1} of {path} has {counts[wrong[0]]} columns, those before it {layout.width}. "
            f"{decimal or _DAMAGED}"
        )
    kept = [row for row, count in zip(rows, counts, strict=True) if count == layout.width]
    if not kept:
        raise LogError(f"{path} has one row, and it is cut off.")
    ends_within = kept[-1] == len(lines) - 1  # no newline at the end of the file
    if ends_within and _is_cut([lines[row] for row in kept[-LOOKED_AT:]], layout):
        cut = kept.pop()
    return _Rows(kept, tuple(rows[k] for k in wrong), again, cut)


def _is_cut(lines: Sequence[str], layout: TextLayout) -> bool:
    """Whether the last field of a text that ends without a newline is the beginning of a number.

    Many programs write no newline at the end, and many numbers are short. So both must tell: the field is shorter
    than nearly all others of its column, and its number is further from the one before than any two others.
    """
    fields = [fields_of(line, layout.delimiter)[-1].replace(layout.decimal, ".") for line in lines]
    last, others = fields[-1], fields[:-1]
    if len(others) < _FEWEST or not all(is_number(field, comma=False) for field in others):
        return False
    if _BEGUN.fullmatch(last):
        return True
    values = np.array([_value(field) for field in fields])
    if not np.isfinite(values[-2:]).all():
        return False
    as_short = float(np.mean([len(field) <= len(last) for field in others]))
    *steps, last_step = np.abs(np.diff(values))
    return as_short < _SHORT and bool(last_step > _FAR * np.nanmax([0.0, *steps]))


def _value(field: str) -> float:
    """A number as a text, NaN where there is none."""
    try:
        return float(field)
    except ValueError:
        return float("nan")


def _numbers(
    path: Path, lines: Sequence[str], layout: TextLayout, where: list[int], rows: Sequence[int]
) -> tuple[Array, list[str]]:
    """The columns at `where` of lines, which are those at `rows` of the file; and what was odd about their fields."""
    notes: list[str] = []
    try:
        try:
            values = _parse(lines, layout, where, np.float64).to_numpy()
        except ValueError:
            texts = _parse(lines, layout, sorted(set(where)), str)
            read = {k: _column(path, texts, k, layout, rows, notes) for k in texts}
            values = np.column_stack([read[k] for k in where])
    except (ValueError, OverflowError) as error:
        raise LogError(f"{path} cannot be read: {str(error).strip()}.") from error
    if len(values) != len(lines):
        raise LogError(f"{path} has {len(lines)} rows, and {len(values)} where quotation marks join some. Remove them.")
    return np.asarray(values, dtype=np.float64), notes


def _parse(lines: Sequence[str], layout: TextLayout, where: list[int], kind: type) -> pandas.DataFrame:
    return pandas.read_csv(
        io.StringIO("\n".join(lines)),
        sep=DELIMITERS[layout.delimiter],
        header=None,
        names=list(range(layout.width)),
        usecols=sorted(set(where)),
        comment=layout.comment or None,
        decimal=layout.decimal,
        dtype=kind,
        index_col=False,
        keep_default_na=kind is not str,
        skipinitialspace=True,
    )[where]


def _column(
    path: Path, texts: pandas.DataFrame, k: int, layout: TextLayout, rows: Sequence[int], notes: list[str]
) -> Array:
    """A column of fields as numbers; those that are missing, and a few that are none, are NaN.

    Raises:
        LogError: fields are no numbers; the message says which one is the first.
    """
    column = texts[k].astype(str).str.strip()
    if (seconds := seconds_of(column.tolist())) is not None:
        notes.append(f"times of day in column {k + 1} are read as seconds from the first, {column.iloc[0]}")
        return seconds
    if layout.decimal == ",":
        column = column.str.replace(",", ".")
    numbers = pandas.to_numeric(column, errors="coerce")
    bad = (numbers.isna() & ~column.str.lower().isin(MISSING)).to_numpy()
    if bad.any():
        row = int(np.argmax(bad))
        field = str(texts[k].iloc[row])
        is_hexadecimal = field[:2].lower() == "0x"
        hint = "hexadecimal; leave that column out of the mapping" if is_hexadecimal else "no number"
        name = f" ({layout.names[k]})" if k < len(layout.names) else ""
        where_found = f"{field[:40]!r} in column {k + 1}{name}"
        if is_hexadecimal or bad.sum() > _TORN * len(bad):
            raise LogError(f"Line {rows[row] + 1} of {path} has {where_found}: {hint}.")
        more = f"and {int(bad.sum()) - 1} more fields that are no numbers are" if bad.sum() > 1 else "is"
        notes.append(f"{where_found} of line {rows[row] + 1} {more} taken as missing")
    return np.asarray(numbers, dtype=np.float64)
