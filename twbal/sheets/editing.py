"""Changes of single values in the text of a sheet that a person wrote: all other text stays, comments too."""

import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import yaml

from twbal.core.errors import ConfigError
from twbal.core.robot_sheet import ValueProvenance
from twbal.sheets.writing import number

_BLOCK = "# twbal check-link, "
"""Begins the lines of comment that `noted` keeps at a sheet's end."""

_EARLIER = re.compile(r"(?:[^;:]*; before: [^;:]*(?:: |$))+")
"""Remarks of earlier changes, in front of what the person wrote."""


class SheetEdit(NamedTuple):
    """A new value.

    Attributes:
        key: of the value.
        value: in SI units.
        provenance: where it comes from now.
        source: the same in words, for the comment.
    """

    key: str
    value: float
    provenance: ValueProvenance
    source: str


def edited(text: str, changes: Sequence[SheetEdit]) -> str:
    """The text of a sheet with new values; what was before is kept in the comment beside each.

    Args:
        text: of the sheet.
        changes: at most one of each value.

    Raises:
        ConfigError: the sheet is written in a way in which these values cannot be changed.
    """
    wanted = sheet_values(text)
    for change in changes:
        before = wanted[change.key]
        old = next((kind for kind, names in wanted["provenance"].items() if change.key in (names or ())), "unknown")
        text = _with_value(text, change, f"{change.source}; before: {before}, {old}")
        text = _with_provenance(text, change.key, change.provenance)
        wanted[change.key] = number(change.value)
        names = {kind: [name for name in names if name != change.key] for kind, names in wanted["provenance"].items()}
        names[change.provenance] = [*names.get(change.provenance, ()), change.key]
        wanted["provenance"] = names
    if _plain(sheet_values(text)) != _plain(wanted):
        by_hand = ", ".join(f"{change.key}: {number(change.value)} ({change.provenance})" for change in changes)
        raise ConfigError(f"The sheet is written in a way that cannot be changed here. Change it by hand: {by_hand}.")
    return text


def renamed(text: str, name: str) -> str:
    """The text of a sheet for a robot of another name."""
    node = _entry(yaml.compose(text), "name")
    return text[: node.start_mark.index] + name + text[node.end_mark.index :]


def noted(text: str, title: str, lines: Sequence[str]) -> str:
    """The text of a sheet with lines of comment at its end, in place of those of an earlier call.

    Args:
        text: of the sheet.
        title: behind the program's name.
        lines: without their comment signs.
    """
    without = re.sub(rf"^{_BLOCK}.*\n(?:#   .*\n?)*", "", text, flags=re.MULTILINE)
    end = "" if without.endswith("\n") else "\n"
    return "".join([without, end, f"{_BLOCK}{title}:\n", *(f"#   {line}\n" for line in lines)])


def sheet_values(text: str) -> dict[str, Any]:
    """What a sheet says: texts, also where it says numbers, and `provenance` as lists of names.

    Raises:
        ConfigError: it is no sheet.
    """
    try:
        root = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.YAMLError as error:
        raise ConfigError(f"The sheet is no yaml: {' '.join(str(error).split())}.") from error
    tree = _data(root)
    if not isinstance(tree, dict) or not isinstance(tree.get("provenance"), dict) or "name" not in tree:
        raise ConfigError("The file is no sheet of a robot: it has no name, or no provenance.")
    return tree


def _with_value(text: str, change: SheetEdit, remark: str) -> str:
    """The new number in place of the old one, and a remark at the begin of the comment behind it."""
    node = _entry(yaml.compose(text), change.key)
    start, end = node.start_mark.index, node.end_mark.index
    line, newline, rest = text[end:].partition("\n")
    blank, sign, comment = line.partition("#")
    unit, _, former = comment.strip().partition(";")
    former = _EARLIER.sub("", former.strip())
    said = f"{unit.strip()}; {remark}" if unit else remark
    said += f": {former}" if former else ""
    return f"{text[:start]}{number(change.value)}{blank if sign else '  '}# {said}{newline}{rest}"


def _with_provenance(text: str, key: str, provenance: ValueProvenance) -> str:
    """`key` in the list of another provenance."""
    root = yaml.compose(text)
    for kind, names in _entry(root, "provenance").value:
        for item in names.value if isinstance(names, yaml.SequenceNode) else ():
            if item.value == key:
                if kind.value == provenance:
                    return text
                text = _without_item(text, names, item)
    return _with_item(text, key, provenance)


def _without_item(text: str, names: yaml.SequenceNode, item: yaml.ScalarNode) -> str:
    start, end = item.start_mark.index, item.end_mark.index
    if not names.flow_style:  # a line of its own
        line = text.rfind("\n", 0, start)
        following = text.find("\n", end)
        following = len(text) if following < 0 else following
        replaced = " []" if len(names.value) == 1 else ""
        return text[:line] + replaced + text[following:]
    after = re.match(r"\s*,[ \t]*", text[end:])
    if after:
        return text[:start] + text[end + after.end() :]
    before = re.search(r",\s*\Z", text[:start])
    return text[: before.start() if before else start] + text[end:]


def _with_item(text: str, key: str, provenance: ValueProvenance) -> str:
    kinds = _entry(yaml.compose(text), "provenance")
    names = next((names for kind, names in kinds.value if kind.value == provenance), None)
    if names is None:
        first = kinds.value[0][0].start_mark
        indent = " " * first.column
        return f"{text[: first.index]}{provenance}: [{key}]\n{indent}{text[first.index :]}"
    if names.flow_style or not names.value:
        end = text.rfind("]", 0, names.end_mark.index)
        return f"{text[:end]}{', ' if names.value else ''}{key}{text[end:]}"
    last = names.value[-1]
    dash = text.rfind("\n", 0, last.start_mark.index) + 1
    end = text.find("\n", last.end_mark.index)
    end = len(text) if end < 0 else end
    return f"{text[:end]}\n{text[dash : last.start_mark.index]}{key}{text[end:]}"


def _entry(root: Any, key: str) -> Any:
    return next(value for name, value in root.value if name.value == key)


def _data(node: Any) -> Any:
    if isinstance(node, yaml.MappingNode):
        return {key.value: _data(value) for key, value in node.value}
    if isinstance(node, yaml.SequenceNode):
        return [item.value for item in node.value]
    return None if node is None else node.value


def _plain(tree: Mapping[str, Any]) -> dict[str, Any]:
    """A sheet for comparison: which order a provenance's names have, and whether it has none, does not count."""
    kinds = {str(kind): sorted(names) for kind, names in tree["provenance"].items() if names}
    return {**tree, "provenance": kinds}
