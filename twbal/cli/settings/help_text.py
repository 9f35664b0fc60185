"""The table of settings as text: what `--help` shows of a stage's configuration."""

import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any

from twbal.cli.settings.kinds import Setting
from twbal.cli.settings.lookup import Leaf, Table, leaves

WIDTH = 110
"""Characters of the longest line."""

_CHOICES = (
    "Choices: group=option; [this] is chosen. docs/glossary.md says what they are.",
    "Settings below are those of what is chosen: give group=option before --help to see those of another option.",
)
_FILES = {
    "robot": "or a sheet: <folder>/robot/<name>.yaml",
    "sim": "or what diagnose or identify wrote: <file>.yaml, <run folder>",
}
_LONGEST_VALUE = 32
_OTHER_THAN_TEXT = re.compile(r"[+-]?(\d+\.?\d*(e[+-]?\d+)?|\.\d+(e[+-]?\d+)?|nan|inf)|true|false|null", re.IGNORECASE)
"""What is text in quotes only."""
_QUOTED_IN_LIST = re.compile(r"[=,{}()\[\]\"']")
"""Characters of a text that Hydra takes in a list in quotes only."""
_INDENT, _GAP = 2, 2
_NARROWEST_WORD, _WIDEST_WORD = 26, 46


def help_text(stage: str, tree: Mapping[str, Any], choices: Mapping[str, tuple[str, Sequence[str]]]) -> str:
    """Choices, settings that are changed most, and the others: one line each.

    Args:
        stage: its name on the command line.
        tree: its configuration as plain values; references as they are written.
        choices: of each group what is chosen, and all that there is.
    """
    table = Table(stage, tree)
    own_first = sorted(leaves(tree), key=lambda leaf: "." in leaf.key)
    known = [(leaf, table.row(leaf.key)) for leaf in own_first]
    common = [(leaf, row) for leaf, row in known if row is not None and row.common]
    others = [(leaf, row) for leaf, row in known if row is None or not row.common]
    parts = []
    if choices:
        parts.append([*_CHOICES, "", *_choice_lines(choices)])
    if common:
        parts.append(["Settings that are changed most: key=value, its range and unit, its meaning", "", *_rows(common)])
    if others:
        parts.append(["All other settings", "", *_rows(others)])
    return "\n\n".join("\n".join(part) for part in parts)


def _choice_lines(choices: Mapping[str, tuple[str, Sequence[str]]]) -> Iterator[str]:
    width = max(map(len, choices))
    for group, (chosen, options) in choices.items():
        words = " ".join(f"[{option}]" if option == chosen else option for option in options)
        words += f", {_FILES[group]}" if group in _FILES else ""
        indent = " " * (width + 4)
        yield from textwrap.wrap(
            f"  {group:{width}}  {words}",
            WIDTH,
            subsequent_indent=indent,
            break_long_words=False,
            break_on_hyphens=False,
        )


def _rows(settings: Iterable[tuple[Leaf, Setting | None]]) -> Iterator[str]:
    """A line for each setting; a blank one where another part of the configuration begins."""
    for index, (_, part) in enumerate(groupby(settings, key=lambda known: _part_of(known[0].key))):
        if index:
            yield ""
        yield from _aligned([_cells(leaf, row) for leaf, row in part])


def _part_of(key: str) -> str:
    """The part of the configuration that a key belongs to; "" for the stage itself."""
    return key.partition(".")[0] if "." in key else ""


def _cells(leaf: Leaf, row: Setting | None) -> tuple[str, str, str]:
    """What is set, to what it can be, and what it means."""
    word = f"{leaf.key}={shown(leaf.value)}"
    return (word, "", "") if row is None else (word, f"{row.kind.range} {row.kind.unit}".strip(), row.meaning)


def _aligned(lines: Sequence[tuple[str, str, str]]) -> Iterator[str]:
    """Lines in columns; one that is too long for that runs on, and is cut at the width."""
    words, ranges, meanings = zip(*lines, strict=True)
    most = WIDTH - _INDENT - 2 * _GAP - max(map(len, meanings))
    range_wide = min(max(map(len, ranges)), most - _NARROWEST_WORD)
    wide = max(_NARROWEST_WORD, min(max(map(len, words)), _WIDEST_WORD, most - range_wide))
    for word, span, meaning in lines:
        known = f"{word:{wide}}{'':{_GAP}}{span}"  # a long word takes its room from the range's
        line = f"{'':{_INDENT}}{known:{wide + _GAP + range_wide}}{'':{_GAP}}{meaning}".rstrip()
        if len(line) > WIDTH:
            line = f"{'':{_INDENT}}{word}{'':{_GAP}}{span}{'':{_GAP}}{meaning}"
        yield line if len(line) <= WIDTH else f"{line[: WIDTH - 3]}..."


def shown(value: Any, longest: int = _LONGEST_VALUE) -> str:
    """A value in one line, as it is given on the command line.

    Args:
        value: plain.
        longest: characters, beyond which it is cut.
    """
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, list):
        text = f"[{','.join(_in_list(each, longest) for each in value)}]"
    elif isinstance(value, str) and (not value.strip() or _OTHER_THAN_TEXT.fullmatch(value)):
        text = f"'{value.strip()}'"
    else:
        text = " ".join(str(value).split())
    return text if len(text) <= longest else f"{text[: longest - 3]}..."


def _in_list(value: Any, longest: int) -> str:
    """A value as it stands in a list; a reference to another setting is left as it is."""
    text = shown(value, longest)
    if not isinstance(value, str) or text != value or "${" in text or not _QUOTED_IN_LIST.search(text):
        return text
    escaped = text.replace('"', '\\"')
    return f'"{escaped}"'
