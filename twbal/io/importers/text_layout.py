"""How a text of columns is laid out: what parts them, their names and units, text before the header."""

import csv
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from twbal.core.errors import LogError, printable
from twbal.io.importers.column_units import is_unit
from twbal.io.importers.fields import DECIMAL_COMMA, MISSING, is_number, is_time
from twbal.io.importers.formats import readable
from twbal.io.importers.text_lines import TextLines

BLANKS = "blanks"
DELIMITERS = {";": ";", "\t": "\t", ",": ",", BLANKS: r"\s+"}  # what is looked for, in this order
COMMENTS = "%#"
LOOKED_AT = 200  # lines from which the layout is told
_COMMAS = (
    "The numbers seem to have decimal commas, which cannot be told from the commas between columns. Write the file "
    "with semicolons between columns, or with decimal points."
)
_WRONG_NAMES = "Give each column one name, or begin the header with # and map columns by their numbers."


class TextLayout(NamedTuple):
    """How a text file is laid out.

    Attributes:
        delimiter: between columns: `;`, a tab, `,` or `BLANKS`.
        decimal: `.` or `,`.
        comment: character that begins comments; "" where none was seen.
        names: of the columns, from the header; empty without one.
        width: number of columns.
        units: of the columns, from a row below the header; empty without one.
        sample: fields of some lines, for whoever guesses what they mean.
        comments: lines before the first of these that are comments, without what begins them.
        before: lines of text before the header that are neither comments nor columns, such as boot messages.
        has_header: whether the names stand in a row of their own.
    """

    delimiter: str
    decimal: str
    comment: str
    names: tuple[str, ...]
    width: int
    units: tuple[str, ...]
    sample: tuple[tuple[str, ...], ...]
    comments: tuple[str, ...]
    before: int
    has_header: bool


def layout_of(path: Path, text: TextLines) -> TextLayout:
    """Tell the layout of a text from its first lines.

    Raises:
        LogError: it has no columns of numbers.
    """
    first, comment, comments = _first_lines(text.lines)
    if not first:
        raise LogError(f"{path} is empty{' but for comments' if comment else ''}: no rows of numbers in it.")
    delimiter = _delimiter(first)
    rows = [fields_of(line, delimiter) for line in first]
    comma = any(DECIMAL_COMMA.fullmatch(field) for row in rows for field in row)
    before = _before(rows, comma)
    first, rows = first[before:], rows[before:]
    is_header = not text.names and _is_header(rows, comma)
    header = rows[0] if is_header else None
    units = _units_below(path, first, rows, comma) if header and len(rows) > 2 else ()
    if units:
        body = rows[2:]
    else:
        body = rows[1:] if header and len(rows) > 1 and any(_is_value(f, comma) for f in rows[1]) else rows
    names = tuple(map(printable, header)) if header and body is not rows else ()
    if not any(is_number(field, comma) and field for row in body for field in row):
        raise LogError(f"{path} has no columns of numbers; its first line is {first[0][:60]!r}. {readable()}.")
    has_header = bool(names)
    names = names or text.names
    width = len(names) if names and len(names) == _most(body) else len(body[0])
    full = [tuple(row) for row in body if len(row) == width]
    sample = tuple(row for row in full if not is_of_names(row, names)) or tuple(full)
    return TextLayout(
        delimiter, "," if comma else ".", comment, names, width, units, sample, comments, before, has_header
    )


def _is_value(field: str, comma: bool) -> bool:
    """Whether a field is what a row has: a number, a time of day, or a word that says that it is missing."""
    return is_number(field, comma) or is_time(field) or field.lower() in MISSING


def _is_header(rows: Sequence[Sequence[str]], comma: bool) -> bool:
    """Whether the first row names columns: one in which a word is, where most rows have a value.

    A word that all rows have, such as the `ypr` or `$IMU` that a program writes before its numbers, names no column.
    """
    first, width = rows[0], _most(rows)
    words = [k for k, field in enumerate(first) if not _is_value(field, comma)]
    body = [row for row in rows[1:] if len(row) == width]
    if len(first) != width or not body:
        return bool(words)
    shares = [sum(_is_value(row[k], comma) for row in body) / len(body) for k in range(width)]
    return any(shares[k] > 0.5 for k in words)


def is_of_names(fields: Sequence[str], names: Sequence[str]) -> bool:
    """Whether most fields of a row are names of columns, in whatever order."""
    known = set(names) - {""}
    return len(fields) == len(names) and 2 * len(known & set(fields)) > len(known)


def _most(rows: Sequence[Sequence[str]]) -> int:
    """The number of fields that most rows have."""
    counts = [len(row) for row in rows]
    return max(set(counts), key=counts.count)


def _before(rows: Sequence[Sequence[str]], comma: bool) -> int:
    """How many lines come before the columns begin: boot messages, a title, a first line without its beginning.

    They have another number of fields than most lines, and cannot be a header with a name too many or too few.

    Args:
        rows: fields of the first lines.
        comma: whether numbers may have decimal commas.
    """
    width = _most(rows)
    before = [len(row) for row in rows].index(width)
    if width < 2 or before == 0:
        return 0
    header = [field for field in rows[before] if field]
    is_header = bool(header) and not any(_is_value(field, comma) for field in header)
    if is_header:
        return 0 if 2 * sum(map(is_unit, header)) >= len(header) else before
    last = rows[before - 1]
    is_cut = before == 1 and len(last) < width and all(_is_value(field, comma) for field in last)
    return before if is_cut or (len(last) == 1 and width > 2) else 0


def _units_below(path: Path, first: Sequence[str], rows: Sequence[Sequence[str]], comma: bool) -> tuple[str, ...]:
    """The second row where it tells the units of the columns; empty where it has numbers.

    Args:
        path: of the file, for errors.
        first: its first lines.
        rows: their fields.
        comma: whether numbers may have decimal commas.

    Raises:
        LogError: it has text alone that is no units, so that nobody knows which row names the columns.
    """
    names, told, numbers = ([field for field in row if field] for row in rows[:3])
    if any(is_number(field, comma) for field in told) or not any(is_number(field, comma) for field in numbers):
        return ()
    if told and 2 * sum(map(is_unit, told)) >= len(told):
        return tuple(map(printable, rows[1]))
    if len(told) < len(rows[1]) or any(_is_value(field, comma) for field in [*names, *told]):
        return ()
    wrong = first[0] if len(rows[1]) == len(rows[2]) != len(rows[0]) else first[1]
    raise LogError(
        f"{path} has two lines of text before its numbers, so that it is not clear which one names the columns. "
        f"Begin {wrong[:60]!r} with # or remove it."
    )


def check_names(path: Path, layout: TextLayout, given: Sequence[str] = ()) -> None:
    """Check that there is a name for each column; one delimiter too many may end the header, or each line.

    Args:
        path: of the file, for errors.
        layout: of the file.
        given: names of the columns, where the file has no header; empty: there are none.

    Raises:
        LogError: there are more or fewer, so that nobody knows which name belongs to which column.
    """
    names = layout.names or tuple(given)
    count, width = len(names), layout.width
    is_ended = width == count + 1 and not any(row[-1] for row in layout.sample)
    if not names or count == width or is_ended or (count == width + 1 and not names[-1]):
        return
    which = f"The header of {path} names" if layout.names else f"{path} has no header, and the mapping names"
    found = f"{which} {count} column{'s' if count > 1 else ''}, and the first row of numbers has {width}"
    row = (" " if layout.delimiter == BLANKS else layout.delimiter).join(layout.sample[0])
    raise LogError(f"{found} ({row[:60]!r}). {decimal_commas(layout) or _WRONG_NAMES}")


def decimal_commas(layout: TextLayout) -> str:
    """What to do about numbers with decimal commas between commas, where the fields may be parts of such numbers."""
    after_comma = [all(field.isdigit() for field in column) for column in list(zip(*layout.sample, strict=True))[1:]]
    surplus = layout.width - len(layout.names)
    if layout.delimiter != "," or any("." in field for row in layout.sample for field in row):
        return ""
    return _COMMAS if 0 < surplus <= min(sum(after_comma), len(layout.names)) else ""


def _first_lines(lines: Sequence[str]) -> tuple[list[str], str, tuple[str, ...]]:
    """The first lines that are neither empty nor comments, the character that begins comments, and those before."""
    found: list[str] = []
    comment, comments = "", []
    for line in lines:
        stripped = line.strip()
        if stripped[:1] and stripped[0] in COMMENTS:
            comment = comment or stripped[0]
            comments += [] if found else ["\t".join(map(printable, stripped.lstrip(COMMENTS).strip().split("\t")))]
        elif stripped:
            found.append(stripped)
        if len(found) == LOOKED_AT:
            break
    return found, comment, tuple(comments)


def fields_of(line: str, delimiter: str) -> list[str]:
    """The fields of a line; a delimiter in quotation marks is none."""
    parts = line.split() if delimiter == BLANKS else line.split(delimiter)
    if delimiter != BLANKS and '"' in line:
        with suppress(csv.Error):  # a field beyond its limit, or an end of a line within one
            parts = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))
    return [part.strip().strip('"') for part in parts]


def _delimiter(lines: Sequence[str]) -> str:
    """The delimiter that parts most of the lines into the same number of columns, more than one.

    By hand, as `csv.Sniffer` knows no columns that blanks align, and takes a minute on 60 kB of quotation marks.
    """
    best, chosen = (0.0, 0), BLANKS
    for delimiter in DELIMITERS:
        counts = [len(fields_of(line, delimiter)) for line in lines]
        common = max(set(counts), key=counts.count)
        score = (counts.count(common) / len(counts) if common > 1 else 0.0, -list(DELIMITERS).index(delimiter))
        if score > best and score[0] > 0.5:
            best, chosen = score, delimiter
    return chosen
