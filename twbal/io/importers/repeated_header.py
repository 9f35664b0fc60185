"""Headers further down in a text of columns, as a program writes them that begins anew."""

from collections.abc import Sequence
from pathlib import Path

from twbal.core.errors import LogError, printable
from twbal.io.importers.text_layout import fields_of, is_of_names

_SHOWN = 80  # characters of a header


def repeated_headers(path: Path, lines: Sequence[str], rows: Sequence[int], header: int, delimiter: str) -> list[int]:
    """Which rows repeat the header; blanks and quotation marks about its names do not count.

    Args:
        path: of the file, for errors.
        lines: of the text.
        rows: those that are looked at, from 0 on.
        header: which line is the header.
        delimiter: between columns.

    Raises:
        LogError: a row has the names of the header in another order, so that those below it are other columns.
    """
    names = fields_of(lines[header], delimiter)
    known = sorted({name for name in names if name}, key=len, reverse=True)
    marks = known[: (len(known) + 1) // 2]  # a row with most of the names has one of these
    again = []
    for row in rows:
        line = lines[row]
        if not any(mark in line for mark in marks):
            continue
        fields = fields_of(line, delimiter)
        if fields == names:
            again.append(row)
        elif is_of_names(fields, names) and any(
            field != name and field in names for field, name in zip(fields, names, strict=True)
        ):
            raise LogError(
                f"Line {row + 1} of {path} is a header with the columns in another order ({_shown(line)}) than in the "
                f"first one ({_shown(lines[header])}), so that the rows below it are other columns. Cut the file "
                "there, and import both parts, each with its header."
            )
    return again


def _shown(line: str) -> str:
    """The beginning of a line, as a terminal may show it."""
    text = line.strip()
    return printable(text if len(text) <= _SHOWN else f"{text[:_SHOWN]}...")
