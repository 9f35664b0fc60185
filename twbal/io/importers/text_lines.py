"""The lines of a text file, whatever its encoding and the ends of its lines."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from twbal.core.errors import LogError
from twbal.io.importers.column_units import is_unit
from twbal.io.importers.columns import file_data
from twbal.io.importers.text_bytes import decoded

_COMPRESSED = {
    b"\x1f\x8b": "gzip: unpack it first, by gunzip",
    b"BZh": "bzip2: unpack it first, by bunzip2",
    b"\xfd7zXZ\0": "xz: unpack it first, by unxz",
    b"\x28\xb5\x2f\xfd": "zstd: unpack it first, by unzstd",
    b"PK\x03\x04": "zip: unpack it first, or export it as CSV where it is a workbook of a spreadsheet",
}
"""What compressed files begin with, and what to do about them."""
_LABELLED = re.compile(  # without blanks before it: searches in long lines of blanks would take minutes
    r"(?<![^,;\s|])([^\W\d][^\s:=,;\"'{}|]*)\s*[:=]\s*([+-]?[\d.][^\s:=,;\"'{}|]*|[+-]?nan|[+-]?inf)(?=[,;\s|]|$)",
    re.I,
)
_LOOKED_AT = 100  # lines by which it is told whether numbers have their names before them
_MOST = 0.8  # share of them that have, at least
_STAMP = re.compile(  # as the serial monitors of Arduino and PlatformIO write them, and terminals in brackets
    r"\d{1,2}:\d\d:\d\d[.,:]\d+ -?> ?|\[(?:\d{4}-\d\d-\d\d[ T])?\d{1,2}:\d\d:\d\d(?:[.,:]\d+)?\][ \t]*"
)
_COLOURS = re.compile(r"\x1b\[[\d;]*m")
_ESP = re.compile(r"^[EWIDV] \((\d+)\) [\w.-]+: *")  # as the log of an ESP32 begins its lines, with ms since its start
_WITH_UNIT = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)([^\W\d]\S*|[°%]\S*)")
_BRACKETS = {"[": "]", "(": ")"}


class TextLines(NamedTuple):
    """The lines of a text file.

    Attributes:
        lines: without their ends.
        names: of its columns, where each number has one before it (`pitch:0.1`).
        notes: what was odd about the bytes of the file.
    """

    lines: list[str]
    names: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def text_of(path: Path) -> TextLines:
    """The lines of a text file.

    They come without the time that serial monitors write before each (`... -> `), without brackets around each, and
    without the names that Arduino's plotter wants before each number.

    Raises:
        LogError: it cannot be read, or is no text.
    """
    data = file_data(path)
    for begin, advice in _COMPRESSED.items():
        if data.startswith(begin):
            raise LogError(f"{path} is no text file, but compressed by {advice}.")
    text, notes = decoded(path, data)
    looked_at = text[: 1 << 18]
    odd = sum(not (c.isprintable() or c in "\t\n\r\x1b") for c in looked_at)
    if odd > 0.02 * len(looked_at):
        raise LogError(f"{path} is no text file: {odd} of its first {len(looked_at)} bytes are no characters.")
    return _plain(_parted(_COLOURS.sub("", text)))._replace(notes=notes)


def _parted(text: str) -> list[str]:
    """The lines of a text, whose ends are LF, CR LF, or CR throughout."""
    text = text.replace("\r\n", "\n")
    return text.split("\n" if "\n" in text else "\r")


def _plain(lines: Sequence[str]) -> TextLines:
    return _without_labels(_without_brackets(_without_stamps(lines)))


def _without_brackets(lines: list[str]) -> list[str]:
    """Lines such as `[0, 0.1]` and `(0, 0.1)`, as Python prints them, without their brackets; others as they are."""
    looked_at = [stripped for line in lines if (stripped := line.strip())][:_LOOKED_AT]
    bracketed = [line for line in looked_at if _BRACKETS.get(line[0]) == line[-1]]
    if len(looked_at) < 2 or len(bracketed) < _MOST * len(looked_at):
        return lines
    return [s[1:-1] if (s := line.strip()) and _BRACKETS.get(s[0]) == s[-1] else line for line in lines]


def _without_labels(lines: list[str]) -> TextLines:
    """Lines such as `time:0,pitch:0.1deg` as `0,0.1` with the names `time` and `pitch [deg]`; others as they are.

    The time of an ESP32's log (`I (1234) balance: pitch=0.1`) becomes the first column.
    """
    with_time = [_ESP.sub(r"time_ms:\1, ", line, count=1) for line in lines]
    lines = with_time if with_time != lines and _common_labels(with_time) else lines
    names = _common_labels(lines)
    if not names:
        return TextLines(lines)
    values = [_values(line) if _labels(line) == names else None for line in lines]
    units = _units([row for row in values if row is not None], len(names))
    plain = [
        line if row is None else ",".join(_number(value, unit) for value, unit in zip(row, units, strict=True))
        for line, row in zip(lines, values, strict=True)
    ]
    return TextLines(
        plain, tuple(f"{name} [{unit}]" if unit else name for name, unit in zip(names, units, strict=True))
    )


def _common_labels(lines: Sequence[str]) -> tuple[str, ...]:
    """The names that stand before the numbers of most lines; none where they do not."""
    looked_at = [line for line in lines if line.strip()][:_LOOKED_AT]
    labels = [_labels(line) for line in looked_at]
    names = max(labels, key=labels.count, default=())
    if len(names) < 2 or len(set(names)) < len(names) or labels.count(names) < _MOST * len(labels):
        return ()
    return names


def _units(rows: Sequence[Sequence[str]], width: int) -> list[str]:
    """The units that are written behind all numbers of a column, "" where there are none."""
    units = []
    for k in range(width):
        found = {match[2] if (match := _WITH_UNIT.fullmatch(row[k])) else "" for row in rows[:_LOOKED_AT]}
        units.append(unit if len(found) == 1 and is_unit(unit := found.pop()) else "")
    return units


def _number(value: str, unit: str) -> str:
    return value[: -len(unit)] if unit and value.endswith(unit) else value


def _labels(line: str) -> tuple[str, ...]:
    """The names in a line of names and values; none in any other line."""
    return tuple(each[1] for each in _LABELLED.finditer(line)) if _is_labelled(line) else ()


def _values(line: str) -> list[str]:
    return [each[2] for each in _LABELLED.finditer(line)]


def _is_labelled(line: str) -> bool:
    return not _LABELLED.sub("", line).strip(", ;|\t")


def _without_stamps(lines: Sequence[str]) -> list[str]:
    """Lines without the stamps of a serial monitor, where the first one that is not empty has one."""
    if not _STAMP.match(next((line for line in lines if line.strip()), "")):
        return list(lines)
    return [_STAMP.sub("", line, count=1) if _STAMP.match(line) else line for line in lines]
