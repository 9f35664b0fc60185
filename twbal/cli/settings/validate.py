"""Holds a configuration against the table of settings."""

import difflib
import inspect
import math
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any, NamedTuple

from hydra.utils import get_object

from twbal.cli.settings.comma_number import is_comma_number
from twbal.cli.settings.help_text import shown
from twbal.cli.settings.kinds import Setting
from twbal.cli.settings.lookup import Leaf, Table, effects_in, leaves
from twbal.cli.settings.nested_settings import ancestors
from twbal.cli.settings.renamed import name_now, renamed
from twbal.core.errors import ConfigError

FREE = ("agent.options",)  # parts with names of another library, which checks them
_COST = "cost"
_NAMED = 3  # further wrong settings that are named one by one
_LONGEST_VALUE = 60  # characters of a value that are shown


class InvalidSetting(NamedTuple):
    """A setting that cannot be right.

    Attributes:
        key: dotted.
        found: its value.
        expected: what it may be, in words.
        meaning: of the setting; "" where nobody knows.
        instead: how the value that is meant is written; "" where nobody knows.
    """

    key: str
    found: Any
    expected: str
    meaning: str
    instead: str = ""


def check(stage: str, tree: Mapping[str, Any]) -> None:
    """Refuse a configuration that has a value out of its range or of the wrong kind.

    Args:
        stage: its name on the command line.
        tree: its configuration as plain values, with all references resolved.

    Raises:
        ConfigError: of the first such value, in one line; it names the others.
    """
    table = Table(stage, tree)
    _refuse_old_names(stage, tree, table)
    _refuse_unknown_names(stage, tree, table)
    found = list(faults(stage, tree))
    if not found:
        return
    first = next((each for each in found if any(of.key.endswith(f".{each.key}") for of in found)), found[0])
    others = [each for each in found if each is not first]  # some of them may refer to the first
    meaning = f" ({first.meaning})" if first.meaning else ""
    named = ", ".join(fault.key for fault in others[:_NAMED])
    more = f" and {len(others) - _NAMED} more" if len(others) > _NAMED else ""
    also = f" Wrong as well: {named}{more}." if others else ""
    value = shown(first.found, _LONGEST_VALUE)
    point = f" Is a decimal point meant? Write {first.found.replace(',', '.')}." if is_comma_number(first.found) else ""
    whole = f" Write {first.key}={first.instead}." if first.instead else ""
    raise ConfigError(
        f"{stage} cannot have {first.key}={value}; expected {first.expected}{meaning}.{point}{whole}{also} "
        f"`twbal {stage} --help` shows all settings with their ranges."
    )


def _refuse_old_names(stage: str, tree: Mapping[str, Any], table: Table) -> None:
    """Refuse a setting that has another name now, which a yaml file of one's own may still have."""
    for leaf in leaves(tree):
        now = None if leaf.is_foreign or table.row(leaf.key) is not None else name_now(leaf.key)
        if now is not None and any(table.row(part) or table.has_parts(part) for part in (*ancestors(now), now)):
            raise ConfigError(f"{stage} {renamed(leaf.key, now)}")


def _refuse_unknown_names(stage: str, tree: Mapping[str, Any], table: Table) -> None:
    """Refuse a setting that nothing reads, beside known ones, as a typo in an experiment makes it."""
    for leaf in leaves(tree):
        place, name = _known_above(leaf.key, table)
        key = f"{place}.{name}"
        is_known = table.row(key) or table.row_above(leaf.key) or table.has_parts(key)
        if leaf.is_foreign or is_known or place in ("", *FREE):
            continue
        beside = table.names_in(place)
        near = difflib.get_close_matches(name, beside, n=1)
        guess = f" (did you mean '{place}.{near[0]}'?)" if near else ""
        if name.isdecimal():  # yaml takes {scale: 0,1} for a scale of 0 and an entry 1
            guess = " (a decimal comma? Write 0.1, with a point)"
        also = _of_cost(tree, name) if place == _COST else ""
        raise ConfigError(f"{stage} has no setting {key!r}{guess}. Those of {place} are: {', '.join(beside)}.{also}")


def _of_cost(tree: Mapping[str, Any], name: str) -> str:
    """What is said besides of an entry of the cost: where it has to be added, by somebody who adds a cost."""
    cost = tree.get(_COST)
    target = str(cost.get("_target_", "")) if isinstance(cost, Mapping) else ""
    try:
        called = get_object(target)
        taken = set(inspect.signature(called).parameters)
    except (ImportError, TypeError, ValueError):  # which is told where the cost is built
        return ""
    kind = getattr(called, "__self__", None)  # of a class method, such as `over`, which takes the fields, too
    if isinstance(kind, type) and is_dataclass(kind):
        taken |= {each.name for each in fields(kind)}
    if name not in taken:
        return f" {target} does not take it either."
    return (
        f" {target} takes it, so add a line such as "
        f'`Setting("{_COST}.{name}", Number(0.0, 1.0), "what it means")` to COST of '
        "twbal/cli/settings/search_settings.py."
    )


def _known_above(key: str, table: Table) -> tuple[str, str]:
    """The nearest part above a key that the table has, and what of the key comes next; "" where it has none of them."""
    place, _, name = key.rpartition(".")
    while place and not table.has_parts(place):
        place, _, name = place.rpartition(".")
    return place, name


def faults(stage: str, tree: Mapping[str, Any]) -> Iterator[InvalidSetting]:
    """All wrong settings, in the order of the configuration."""
    table = Table(stage, tree)
    for leaf in leaves(tree):
        row = None if leaf.is_foreign else table.row(leaf.key)
        if row is not None:
            if not row.kind.takes(leaf.value):
                whole = _as_whole(leaf.value)
                instead = str(whole) if row.kind.takes(whole) else ""
                yield InvalidSetting(leaf.key, leaf.value, row.kind.expected, row.meaning, instead)
        elif not leaf.is_foreign and table.has_parts(leaf.key) and not isinstance(leaf.value, Mapping):
            yield InvalidSetting(leaf.key, leaf.value, "settings of its own", "")
        else:
            yield from _of_unknown(leaf, None if leaf.is_foreign else table.row_above(leaf.key))
    for key, effect in effects_in(tree):
        if "_target_" not in effect:
            yield InvalidSetting(key, dict(effect), f"an effect by its name, as in +effect@{key}=dead_zone", "")


def _of_unknown(leaf: Leaf, above: Setting | None) -> Iterator[InvalidSetting]:
    """Of a setting that the table does not have, such as one of a user's own class."""
    if above is not None:
        yield InvalidSetting(above.key, "{...}", above.kind.expected, above.meaning)
    elif not _is_finite(leaf.value):
        yield InvalidSetting(leaf.key, leaf.value, "finite numbers", "")


def _as_whole(value: Any) -> Any:
    """A number such as 1e9, which is read as no whole number, as the whole number that it is; else the value itself."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _is_finite(value: Any) -> bool:
    if isinstance(value, list):
        return all(map(_is_finite, value))
    return not isinstance(value, float) or math.isfinite(value)
