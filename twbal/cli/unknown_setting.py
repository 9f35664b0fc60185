"""What is said of a setting that a stage does not have: which one is likeliest meant, and how that is written."""

import difflib
import re
import shlex
from collections.abc import Mapping, Sequence
from contextlib import suppress
from types import MappingProxyType
from typing import Any, NamedTuple

from hydra import compose
from hydra.errors import HydraException
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from twbal.cli.commands import parsed, text
from twbal.cli.composition import composing
from twbal.cli.settings.lookup import Table, is_known
from twbal.cli.settings.nested_settings import ancestors, flattened
from twbal.cli.settings.renamed import name_now, renamed
from twbal.cli.settings.validate import FREE
from twbal.cli.unknown_choice import choices_of

_EFFECTS = "sim.effects."
_IN_ENSEMBLE = re.compile(r"(ensemble\.\w+)\.(\w+)")
_HYDRAS_OWN = re.compile(r"_[a-z]+_")
_VIRTUAL_ROBOT = "virtual-robot"


class _Settings(NamedTuple):
    """The settings that a stage has by default.

    Attributes:
        tree: of the configuration, as plain values.
        leaves: values by dotted key.
        known: dotted keys of values and of parts.
    """

    tree: dict[str, Any]
    leaves: dict[str, Any]
    known: list[str]


def no_such_setting(
    key: str, word: str, stage: str, in_python: bool, composed: Mapping[Any, Any] = MappingProxyType({})
) -> str:
    """What is said of a setting that cannot be set.

    Args:
        key: dotted, of the setting.
        word: the override; "" where it is not known.
        stage: its name on the command line.
        in_python: whether a function of the library was called in place of a command.
        composed: what the configuration has, with all that was chosen; empty where it is not known.
    """
    tree, leaves, known = own = _settings(stage)
    for each in (*(f"{key}.{name}" for name in _given(word)), key):
        if said := _no_parameter(each, composed):
            return said
    if key in known and isinstance(leaves.get(key, {}), dict):
        return _no_such_entry(key, word, stage, own)
    if key in leaves:
        return (
            f"{stage} has the setting {key}, but not with what was chosen here: an experiment or a choice of a group "
            f"has other settings in its place. {shown_by(stage, in_python)} with the same choices shows which."
        )
    now = name_now(key)
    if now in known:
        return f"{stage} {renamed(key, now)}"
    if key.startswith(_EFFECTS) and "sim" in tree:
        return _no_effect(key)
    if only := only_with(key, stage):
        return f"{only}: add that."
    if "link" in tree and is_of_virtual_robot(key, known):
        return f"{stage} has no setting {key!r}. {said_of_virtual_robot(word or f'{key}=...')}"
    top = ", ".join(tree)
    near = guess(key, known)
    return f"{stage} has no setting {key!r}{near}. Its settings are: {top}; {shown_by(stage, in_python)} shows all."


def only_with(key: str, stage: str) -> str:
    """That a stage has a setting with some choices of its group alone; "" where it does not.

    Args:
        key: dotted, of the setting.
        stage: its name on the command line.
    """
    group, found = key.split(".")[0], []
    for choice in choices_of(group):
        with composing(), suppress(HydraException, OmegaConfBaseException):  # of a group that the stage does not have
            tree = OmegaConf.to_container(compose(stage.replace("-", "_"), [f"{group}={choice}"]))
            if isinstance(tree, dict) and key in dict(flattened(tree)):
                found.append(f"{group}={choice}")
    return f"{stage} has the setting {key} only with {' or '.join(found)}" if found else ""


def is_of_virtual_robot(key: str, known: Sequence[str]) -> bool:
    """Whether a virtual robot has a setting, and it is not rather one of these that ends alike."""
    return key in _settings(_VIRTUAL_ROBOT).known and ("." in key or _end(key) not in map(_end, known))


def said_of_virtual_robot(word: str) -> str:
    """How a virtual robot is given an override of its own."""
    listed = f'["{word}"]' if '"' not in word and "\\" not in word else text([word])
    return (
        f"It is one of `twbal {_VIRTUAL_ROBOT}`: for the virtual robot on the link give "
        f"{shlex.quote(f'link.overrides={listed}')}."
    )


def shown_by(stage: str, in_python: bool) -> str:
    """What shows the settings of a stage."""
    return f"`twbal {stage} --cfg job`{', on the command line,' * in_python}"


def guess(word: str, known: Sequence[str]) -> str:
    """The known name that is likeliest meant: one of the same last part, one that is alike, or one whose last part is.

    Hydra's own keys, such as `_target_`, are none that a person means.
    """
    ends: dict[str, list[str]] = {}
    for name in sorted(known, key=_depth):
        if not _HYDRAS_OWN.fullmatch(end := _end(name)):
            ends.setdefault(end, []).append(name)
    last = _end(word)
    near = difflib.get_close_matches(word, ends.get(last, []), n=1, cutoff=0.0)
    near = near or difflib.get_close_matches(word, [name for names in ends.values() for name in names], n=1)
    near = near or [ends[end][0] for end in difflib.get_close_matches(last, ends, n=1)]
    return f" (did you mean {near[0]!r}?)" if near else ""


def _settings(stage: str) -> _Settings:
    with composing():
        tree = OmegaConf.to_container(compose(stage.replace("-", "_")))
    assert isinstance(tree, dict)
    leaves = dict(flattened(tree))
    known = list(dict.fromkeys(part for leaf in leaves for part in (*ancestors(leaf), leaf)))
    return _Settings({str(name): value for name, value in tree.items()}, leaves, known)


def _no_such_entry(key: str, word: str, stage: str, own: _Settings) -> str:
    """What is said of several settings that are given at once, by a part that has not all of them."""
    tree, _, known = own
    given = _given(word)
    entry = next((leaf for leaf, _ in flattened(given, f"{key}.") if leaf not in known), "")
    if entry.startswith(_EFFECTS):
        return _no_effect(entry)
    if effect := _IN_ENSEMBLE.match(entry):
        robot, name = effect.groups()
        return f"{robot} has no effect {name!r} to set. Add it by +effect@{robot}.{name}={name}."
    table, added = Table(stage, tree), f"+{entry or f'{key}.<name>'}=..."
    if entry and (only := only_with(entry, stage)):
        return f"{only}: add that."
    place = entry.rpartition(".")[0]
    if not entry or table.row(entry) or place in FREE or _is_foreign(key, tree):
        return f"{stage} cannot set {key} to that: it has no such entries. New ones are added by {added}"
    place = place if table.has_parts(place) else key
    names = table.names_in(place)
    near = guess(entry, [f"{place}.{name}" for name in names])
    return f"{stage} has no setting {entry!r}{near}. Those of {place} are: {', '.join(names)}."


def _given(word: str) -> Mapping[Any, Any]:
    """The mapping that an override gives; empty where it gives none."""
    value = override.value() if (override := parsed(word)) else None
    return value if isinstance(value, dict) else {}


def _is_foreign(key: str, tree: Mapping[str, Any]) -> bool:
    """Whether a part is of a class that is not of twbal."""
    node: Any = tree
    for name in key.split("."):
        node = node.get(name) if isinstance(node, dict) else None
    return isinstance(node, dict) and "_target_" in node and not is_known(str(node["_target_"]))


def _no_parameter(key: str, composed: Mapping[Any, Any]) -> str:
    """What is said of a parameter that an effect of the configuration does not have; "" where it is none of one."""
    from twbal.effects.library import effect_name, effect_of  # here, as effects need numpy
    from twbal.effects.parameter import parameters_of

    place, _, name = key.rpartition(".")
    node: Any = composed
    for part in place.split("."):
        node = node.get(part) if isinstance(node, Mapping) else None
    kind = effect_of(str(node.get("_target_", ""))) if isinstance(node, Mapping) else None
    names = list(parameters_of(kind)) if kind is not None else []
    if kind is None or name in names:
        return ""
    near = difflib.get_close_matches(name, names, n=1)
    guessed = f" (did you mean {near[0]!r}?)" if near else ""
    own = effect_name(kind)
    of_key = "" if place.endswith(f".{own}") else f", which is {place},"
    return f"The effect {own}{of_key} has no parameter {name!r}{guessed}. Its parameters are: {', '.join(names)}."


def _no_effect(key: str) -> str:
    """What is said of an effect that the simulation does not have, of which a value is set."""
    name = key.removeprefix(_EFFECTS).split(".")[0]
    return f"The simulation has no effect {name!r} to set {key} of. Add it by +effect@{_EFFECTS}{name}={name}."


def _end(name: str) -> str:
    """The last part of a dotted key."""
    return name.rpartition(".")[2]


def _depth(name: str) -> int:
    return name.count(".")
