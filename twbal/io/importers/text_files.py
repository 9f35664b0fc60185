"""Text files of columns: commas, semicolons, tabs or blanks between them, comments, a header or none."""

import codecs
import csv
import io
import re
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas

from twbal.core.errors import LogError, printable
from twbal.core.gaussian import Array
from twbal.io.importers.column_names import is_unit
from twbal.io.importers.columns import Columns, Name, file_data, places
from twbal.io.importers.formats import readable

BLANKS = "blanks"
_DELIMITERS = {";": ";", "\t": "\t", ",": ",", BLANKS: r"\s+"}  # what is looked for, in this order
_COMMENTS = "%#"
_LOOKED_AT = 200  # lines from which the layout is told
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(nan|inf)|0[xX][0-9a-fA-F]+|", re.IGNORECASE)
_BEGUN = re.compile(r"[+-]|[+-]?(\d+\.?\d*|\.\d+)[eE][+-]?")  # a number that was cut off, and none by itself
_FEWEST = 20  # rows by which a last field is judged
_SHORT = 0.05  # share of the other fields that are as short as one that was cut off, at most
_FAR = 3.0  # of the largest other step, by which such a field is off
_COMMAS = (
    "The numbers seem to have decimal commas, which cannot be told from the commas between columns. Write the file "
    "with semicolons between columns, or with decimal points."
)
_DAMAGED = "Was it damaged on its way, or is it two files in one? Mend or cut the file there."
_WRONG_NAMES = "Give each column one name, or begin the header with # and map columns by their numbers."
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")


class Layout(NamedTuple):
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
    """

    delimiter: str
    decimal: str
    comment: str
    names: tuple[str, ...]
    width: int
    units: tuple[str, ...]
    sample: tuple[tuple[str, ...], ...]
    comments: tuple[str, ...]


def layout_of(path: Path, lines: Sequence[str]) -> Layout:
    """Tell the layout of a text from its first lines.

    Raises:
        LogError: it has no columns of numbers.
    """
    first, comment, comments = _first_lines(lines)
    if not first:
        raise LogError(f"{path} is empty{' but for comments' if comment else ''}: no rows of numbers in it.")
    delimiter = _delimiter(first)
    rows = [fields_of(line, delimiter) for line in first]
    comma = any(_DECIMAL_COMMA.fullmatch(field) for row in rows for field in row)
    header = rows[0] if not all(_is_number(field, comma) for field in rows[0]) else None
    units = _units_below(path, first, rows, comma) if header and len(rows) > 2 else ()
    if units:
        body = rows[2:]
    else:
        body = rows[1:] if header and len(rows) > 1 and any(_is_number(f, comma) for f in rows[1]) else rows
    names = tuple(map(printable, header)) if header and body is not rows else ()
    if not any(_is_number(field, comma) and field for row in body for field in row):
        raise LogError(f"{path} has no columns of numbers; its first line is {first[0][:60]!r}. {readable()}.")
    sample = tuple(map(tuple, body))
    return Layout(delimiter, "," if comma else ".", comment, names, len(body[0]), units, sample, comments)


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
    if any(_is_number(field, comma) for field in told) or not any(_is_number(field, comma) for field in numbers):
        return ()
    if told and 2 * sum(map(is_unit, told)) >= len(told):
        return tuple(map(printable, rows[1]))
    if len(told) < len(rows[1]) or any(_is_number(field, comma) for field in names):
        return ()
    wrong = first[0] if len(rows[1]) == len(rows[2]) != len(rows[0]) else first[1]
    raise LogError(
        f"{path} has two lines of text before its numbers, so that it is not clear which one names the columns. "
        f"Begin {wrong[:60]!r} with # or remove it."
    )


def check_names(path: Path, layout: Layout, given: Sequence[str] = ()) -> None:
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
    is_ended = width == count + 1 and not any(len(row) == width and row[-1] for row in layout.sample)
    if not names or count == width or is_ended or (count == width + 1 and not names[-1]):
        return
    which = f"The header of {path} names" if layout.names else f"{path} has no header, and the mapping names"
    found = f"{which} {count} column{'s' if count > 1 else ''}, and the first row of numbers has {width}"
    row = (" " if layout.delimiter == BLANKS else layout.delimiter).join(layout.sample[0])
    raise LogError(f"{found} ({row[:60]!r}). {_decimal_commas(layout) or _WRONG_NAMES}")


def _decimal_commas(layout: Layout) -> str:
    """What to do about numbers with decimal commas between commas, where the fields may be parts of such numbers."""
    rows = [row for row in layout.sample if len(row) == layout.width]
    after_comma = [all(field.isdigit() for field in column) for column in list(zip(*rows, strict=True))[1:]]
    surplus = layout.width - len(layout.names)
    if layout.delimiter != "," or any("." in field for row in rows for field in row):
        return ""
    return _COMMAS if 0 < surplus <= min(sum(after_comma), len(layout.names)) else ""


def read_text(path: Path, wanted: Sequence[Name], names: Sequence[str] = ()) -> Columns:
    """Columns of a text file.

    A last line that was cut off is left out. Fields that are empty or say NaN become NaN.

    Args:
        path: of the file.
        wanted: which columns.
        names: of all columns, where the file has no header and the mapping knows them.

    Raises:
        LogError: the file cannot be read; the message says in which line and why.
    """
    lines = lines_of(path)
    layout = layout_of(path, lines)
    if any(isinstance(name, str) and not name.isdigit() for name in wanted):
        check_names(path, layout, names)
    where = places(path, layout.names or tuple(names), layout.width, wanted)
    rows, cut = _rows(path, lines, layout)
    notes = []
    if cut:
        notes.append(f"its last line ({cut}) is cut off and left out")
    if layout.units:
        notes.append("the row of units below its header is not used: the mapping tells the units")
    if layout.decimal == ",":
        notes.append("numbers with decimal commas were read as such")
    values = _numbers(path, [lines[row] for row in rows], layout, where, rows)
    return Columns(values, np.array(rows) + 1, np.arange(len(rows)), "line", tuple(notes))


def lines_of(path: Path) -> list[str]:
    """The lines of a text file.

    Raises:
        LogError: it cannot be read, or is no text.
    """
    data = file_data(path)
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):  # as Excel and PowerShell write it
        try:
            return _parted(data.decode("utf-16"))
        except UnicodeDecodeError as error:
            raise LogError(f"{path} begins as text in UTF-16, and breaks off or is none: {error}.") from error
    if b"\0" in data[:65536]:
        raise LogError(
            f"{path} is no text file (it has zero bytes in it), whatever its name says. "
            f"{readable()}; an .mcap file of twbal's needs no import."
        )
    text = _decoded(data)
    looked_at = text[: 1 << 18]
    odd = sum(not (c.isprintable() or c in "\t\n\r") for c in looked_at)
    if odd > 0.02 * len(looked_at):
        raise LogError(f"{path} is no text file: {odd} of its first {len(looked_at)} bytes are no characters.")
    return _parted(text)


def _parted(text: str) -> list[str]:
    """The lines of a text, whose ends are LF, CR LF, or CR throughout."""
    text = text.replace("\r\n", "\n")
    return text.split("\n" if "\n" in text else "\r")


def _decoded(data: bytes) -> str:
    """Text in UTF-8, with or without a byte-order mark; else in Latin-1, which any bytes are."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.removeprefix(b"\xef\xbb\xbf").decode("latin-1")


def _first_lines(lines: Sequence[str]) -> tuple[list[str], str, tuple[str, ...]]:
    """The first lines that are neither empty nor comments, the character that begins comments, and those before."""
    found: list[str] = []
    comment, comments = "", []
    for line in lines:
        stripped = line.strip()
        if stripped[:1] and stripped[0] in _COMMENTS:
            comment = comment or stripped[0]
            comments += [] if found else ["\t".join(map(printable, stripped.lstrip(_COMMENTS).strip().split("\t")))]
        elif stripped:
            found.append(stripped)
        if len(found) == _LOOKED_AT:
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
    for delimiter in _DELIMITERS:
        counts = [len(fields_of(line, delimiter)) for line in lines]
        common = max(set(counts), key=counts.count)
        score = (counts.count(common) / len(counts) if common > 1 else 0.0, -list(_DELIMITERS).index(delimiter))
        if score > best and score[0] > 0.5:
            best, chosen = score, delimiter
    return chosen


def _is_number(field: str, comma: bool) -> bool:
    return bool(_NUMBER.fullmatch(field) or (comma and _DECIMAL_COMMA.fullmatch(field)))


def _rows(path: Path, lines: Sequence[str], layout: Layout) -> tuple[list[int], int]:
    """Which lines, from 0 on, are rows of numbers; and the number of a last line that was cut off (0: none).

    Raises:
        LogError: a line before the last has another number of columns.
    """
    comment = layout.comment or _COMMENTS
    rows = [k for k, line in enumerate(lines) if (stripped := line.strip()) and stripped[0] not in comment]
    if layout.names:
        rows = rows[2:] if layout.units else rows[1:]
    if not rows:
        raise LogError(f"{path} has a header and no rows.")
    if any('"' in line for line in lines):  # a delimiter in quotation marks is none
        return rows, 0
    for row in rows:
        # With a delimiter at their end, lines have one field more, and it is empty.
        width = len(lines[row].split()) if layout.delimiter == BLANKS else lines[row].count(layout.delimiter) + 1
        if width == layout.width:
            continue
        if row == rows[-1]:
            return rows[:-1], row + 1
        raise LogError(
            f"Line {row + 1} of {path} has {width} columns, those before it {layout.width}. "
            f"{_decimal_commas(layout) or _DAMAGED}"
        )
    ends_within = rows[-1] == len(lines) - 1  # no newline at the end of the file
    if ends_within and _is_cut([lines[row] for row in rows[-_LOOKED_AT:]], layout):
        return rows[:-1], rows[-1] + 1
    return rows, 0


def _is_cut(lines: Sequence[str], layout: Layout) -> bool:
    """Whether the last field of a text that ends without a newline is the beginning of a number.

    Many programs write no newline at the end, and many numbers are short. So both must tell: the field is shorter
    than nearly all others of its column, and its number is further from the one before than any two others.
    """
    fields = [fields_of(line, layout.delimiter)[-1].replace(layout.decimal, ".") for line in lines]
    last, others = fields[-1], fields[:-1]
    if len(others) < _FEWEST or not all(_is_number(field, comma=False) for field in others):
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


def _numbers(path: Path, lines: Sequence[str], layout: Layout, where: list[int], rows: Sequence[int]) -> Array:
    """The columns at `where` of lines, which are those at `rows` of the file."""
    try:
        try:
            values = _parse(lines, layout, where, np.float64).to_numpy()
        except ValueError:
            where = sorted(set(where))
            raise _complaint(path, _parse(lines, layout, where, str), layout, where, rows) from None
    except (ValueError, OverflowError) as error:
        raise LogError(f"{path} cannot be read: {str(error).strip()}.") from error
    if len(values) != len(lines):
        raise LogError(f"{path} has {len(lines)} rows, and {len(values)} where quotation marks join some. Remove them.")
    return np.asarray(values, dtype=np.float64)


def _parse(lines: Sequence[str], layout: Layout, where: list[int], kind: type) -> pandas.DataFrame:
    return pandas.read_csv(
        io.StringIO("\n".join(lines)),
        sep=_DELIMITERS[layout.delimiter],
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


def _complaint(path: Path, texts: pandas.DataFrame, layout: Layout, where: list[int], rows: Sequence[int]) -> LogError:
    """Which field is no number."""
    for k in where:
        column = texts[k].astype(str).str.strip()
        if layout.decimal == ",":
            column = column.str.replace(",", ".")
        bad = pandas.to_numeric(column, errors="coerce").isna() & ~column.str.lower().isin(["", "nan", "na", "null"])
        if bad.any():
            row = int(np.argmax(bad.to_numpy()))
            field = str(texts[k].iloc[row])
            hint = "hexadecimal; leave that column out of the mapping" if field[:2].lower() == "0x" else "no number"
            name = f" ({layout.names[k]})" if k < len(layout.names) else ""
            if k < len(layout.names) and field == layout.names[k]:
                return LogError(
                    f"Line {rows[row] + 1} of {path} is its header again: expected is one recording a file. Cut the "
                    "file there."
                )
            return LogError(f"Line {rows[row] + 1} of {path} has {field[:40]!r} in column {k + 1}{name}: {hint}.")
    return LogError(f"{path} has a field that is no number.")
