"""Text files of columns: commas, semicolons, tabs or blanks between them, comments, a header or none."""

import io
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas
from numpy.typing import NDArray

from twbal.core.errors import LogError, printable
from twbal.core.gaussian import Array
from twbal.io.importers.columns import Columns, Name, file_data, places

BLANKS = "blanks"
_DELIMITERS = {";": ";", "\t": "\t", ",": ",", BLANKS: r"\s+"}  # what is looked for, in this order
_COMMENTS = "%#"
_LOOKED_AT = 200  # lines from which the layout is told
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(nan|inf)|0[xX][0-9a-fA-F]+|", re.IGNORECASE)
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_NEWLINE, _BLANK = ord("\n"), 32


class Layout(NamedTuple):
    """How a text file is laid out.

    Attributes:
        delimiter: between columns: `;`, a tab, `,` or `BLANKS`.
        decimal: `.` or `,`.
        comment: character that begins comments; "" where none was seen.
        names: of the columns, from the header; empty without one.
        width: number of columns.
        sample: fields of some lines, for whoever guesses what they mean.
        comments: lines before the first of these that are comments, without what begins them.
    """

    delimiter: str
    decimal: str
    comment: str
    names: tuple[str, ...]
    width: int
    sample: tuple[tuple[str, ...], ...]
    comments: tuple[str, ...]


def layout_of(path: Path, data: bytes) -> Layout:
    """Tell the layout of a text from its first lines.

    Raises:
        LogError: it is no text, or has no columns of numbers.
    """
    lines, comment, comments = _first_lines(path, data)
    if not lines:
        raise LogError(f"{path} is empty{' but for comments' if comment else ''}: no rows of numbers in it.")
    delimiter = _delimiter(lines)
    rows = [fields_of(line, delimiter) for line in lines]
    comma = delimiter != "," and any(_DECIMAL_COMMA.fullmatch(field) for row in rows for field in row)
    header = rows[0] if not all(_is_number(field, comma) for field in rows[0]) else None
    body = rows[1:] if header and len(rows) > 1 and any(_is_number(f, comma) for f in rows[1]) else rows
    names = tuple(map(printable, header)) if header and body is not rows else ()
    if not any(_is_number(field, comma) and field for row in body for field in row):
        raise LogError(f"{path} has no columns of numbers; its first line is {lines[0][:60]!r}.")
    return Layout(delimiter, "," if comma else ".", comment, names, len(body[0]), tuple(map(tuple, body)), comments)


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
    data = content_of(path)
    layout = layout_of(path, data)
    known = layout.names or tuple(names)
    where = places(path, known, layout.width, wanted)
    lines, cut = _lines_of_data(path, data, layout)
    notes = []
    if cut:
        notes.append(f"its last line ({cut}) is cut off and left out")
    if layout.decimal == ",":
        notes.append("numbers with decimal commas were read as such")
    values = _numbers(path, data, layout, sorted(set(where)), lines)
    chosen = values[:, [sorted(set(where)).index(k) for k in where]]
    return Columns(chosen, lines, "line", tuple(notes))


def content_of(path: Path) -> bytes:
    """The bytes of a text file, with plain line ends.

    Raises:
        LogError: it cannot be read, or is no text.
    """
    data = file_data(path)
    if b"\0" in data[:65536]:
        raise LogError(
            f"{path} is no text file (it has zero bytes in it), whatever its name says. "
            "Text, .npy, .npz, .mat, .json and .parquet files can be read; an .mcap file of twbal's needs no import."
        )
    return data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n")


def _first_lines(path: Path, data: bytes) -> tuple[list[str], str, tuple[str, ...]]:
    """The first lines that are neither empty nor comments, the character that begins comments, and those before."""
    text = data[: 1 << 18].decode("latin-1")
    found: list[str] = []
    comment, comments = "", []
    for line in text.split("\n")[: -1 if len(data) > 1 << 18 else None]:
        stripped = line.strip()
        if stripped[:1] and stripped[0] in _COMMENTS:
            comment = comment or stripped[0]
            comments += [] if found else ["\t".join(map(printable, stripped.lstrip(_COMMENTS).strip().split("\t")))]
        elif stripped:
            found.append(stripped)
        if len(found) == _LOOKED_AT:
            break
    odd = sum(not (c.isprintable() or c in "\t\n\r") for c in text)
    if odd > 0.02 * len(text):
        raise LogError(f"{path} is no text file: {odd} of its first {len(text)} bytes are no characters.")
    return found, comment, tuple(comments)


def fields_of(line: str, delimiter: str) -> list[str]:
    """The fields of a line."""
    parts = line.split() if delimiter == BLANKS else line.split(delimiter)
    return [part.strip().strip('"') for part in parts]


def _delimiter(lines: Sequence[str]) -> str:
    """The delimiter that parts most of the lines into the same number of columns, more than one."""
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


def _lines_of_data(path: Path, data: bytes, layout: Layout) -> tuple[NDArray[np.int64], int]:
    """Numbers of the lines that are rows of numbers, and of a last line that was cut off (0: none).

    Raises:
        LogError: a line before the last has another number of columns.
    """
    whole = data if data.endswith(b"\n") else data + b"\n"
    counts, first = _count_fields(whole, layout.delimiter)
    comments = [ord(c) for c in (layout.comment or _COMMENTS)]
    rows = np.flatnonzero((counts > 0) & ~np.isin(first, comments))
    if layout.names:
        rows = rows[1:]
    if not len(rows):
        raise LogError(f"{path} has a header and no rows.")
    odd = np.flatnonzero(counts[rows] != layout.width) if b'"' not in data else np.empty(0, np.int64)
    # with a delimiter at their end, lines have one field more, and it is empty
    if len(odd) and odd[0] < len(rows) - 1:
        line = int(rows[odd[0]])
        raise LogError(
            f"Line {line + 1} of {path} has {counts[line]} columns, those before it {layout.width}. "
            "Was it damaged on its way, or is it two files in one? Mend or cut the file there."
        )
    cut = int(rows[-1]) + 1 if len(odd) else 0
    return (rows[:-1] if cut else rows).astype(np.int64) + 1, cut


def _count_fields(data: bytes, delimiter: str) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Of each line how many fields it has (0: empty), and its first character that is no blank."""
    counts, firsts = [], []
    for begin, end in _blocks(data):
        block = np.frombuffer(data, np.uint8, end - begin, begin)
        ends = np.flatnonzero(block == _NEWLINE)
        starts = np.concatenate([[0], ends[:-1] + 1])
        first = block[starts]
        if delimiter == BLANKS or (first <= _BLANK).any():
            solid = block > _BLANK
            fresh = np.flatnonzero(solid & ~np.concatenate([[False], solid[:-1]]))  # where runs of characters begin
            runs = _within(fresh, starts, ends)
            first = np.zeros(len(starts), np.uint8)
            first[runs > 0] = block[fresh[np.searchsorted(fresh, starts[runs > 0])]]
        else:
            runs = np.ones(len(starts), np.int64)
        fields = runs if delimiter == BLANKS else _within(np.flatnonzero(block == ord(delimiter)), starts, ends) + 1
        counts.append(np.where(runs > 0, fields, 0))
        firsts.append(first)
    return np.concatenate(counts), np.concatenate(firsts)


def _within(places: NDArray[np.int64], starts: NDArray[np.int64], ends: NDArray[np.int64]) -> NDArray[np.int64]:
    """How many of the sorted places lie in each line."""
    return np.searchsorted(places, ends) - np.searchsorted(places, starts)


def _blocks(data: bytes, size: int = 1 << 24) -> list[tuple[int, int]]:
    """Where blocks of whole lines begin and end."""
    found, begin = [], 0
    while begin < len(data):
        end = len(data) if begin + size >= len(data) else data.rfind(b"\n", begin, begin + size) + 1
        if end <= begin:  # a line longer than a block
            end = data.find(b"\n", begin) + 1
        found.append((begin, end))
        begin = end
    return found


def _numbers(path: Path, data: bytes, layout: Layout, where: list[int], lines: NDArray[np.int64]) -> Array:
    """The columns at `where` of the rows at `lines`."""
    try:
        try:
            return np.asarray(_parse(data, layout, where, len(lines), np.float64), dtype=np.float64)
        except ValueError:
            texts = _parse(data, layout, where, len(lines), str)
    except (ValueError, OverflowError) as error:
        raise LogError(f"{path} cannot be read: {str(error).strip()}.") from error
    raise _complaint(path, texts, layout, where, lines)


def _parse(data: bytes, layout: Layout, where: list[int], rows: int, kind: type) -> pandas.DataFrame:
    return pandas.read_csv(
        io.BytesIO(data),
        sep=_DELIMITERS[layout.delimiter],
        header=None,
        names=list(range(layout.width)),
        usecols=where,
        skiprows=_lines_before(data, layout),
        nrows=rows,
        comment=layout.comment or None,
        decimal=layout.decimal,
        dtype=kind,
        index_col=False,
        encoding="latin-1",
        keep_default_na=kind is not str,
        skipinitialspace=True,
    )


def _lines_before(data: bytes, layout: Layout) -> int:
    """Lines up to the header, which goes too."""
    if not layout.names:
        return 0
    for number, line in enumerate(io.BytesIO(data), start=1):
        stripped = line.strip()
        if stripped and chr(stripped[0]) not in (layout.comment or _COMMENTS):
            return number
    return 0


def _complaint(
    path: Path, texts: pandas.DataFrame, layout: Layout, where: list[int], lines: NDArray[np.int64]
) -> LogError:
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
            return LogError(f"Line {lines[row]} of {path} has {field[:40]!r} in column {k + 1}{name}: {hint}.")
    return LogError(f"{path} has a field that is no number.")
