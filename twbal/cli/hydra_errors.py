"""Turns what Hydra and OmegaConf complain of into one clear error."""

import inspect
import re
import traceback
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml
from hydra._internal.defaults_list import Overrides
from hydra.core.override_parser.types import Override
from hydra.errors import InstantiationException, MissingConfigException, OverrideParseException
from hydra.utils import get_object
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import MissingMandatoryValue, OmegaConfBaseException

from twbal.cli.refused_words import HOME
from twbal.cli.settings.comma_number import is_comma_number
from twbal.cli.unknown_choice import no_such_choice
from twbal.cli.unknown_setting import guess, no_such_setting
from twbal.core.errors import ConfigError, TwbalError

_DEFAULTS = "Expected is a list, as in `defaults: [base, {robot: paper}, _self_]`."
_READING = ("full_path", "file_")
"""What Hydra and OmegaConf call the file that they read, in their functions that do."""


def explained(error: Exception, stage: str, in_python: bool = False) -> TwbalError:
    """What `error`, raised by Hydra or OmegaConf, means to the person who typed the command.

    Args:
        error: as Hydra raised it.
        stage: its name on the command line.
        in_python: whether a function of the library was called in place of a command.
    """
    own = _own_cause(error)
    if own is not None:
        return own
    foreign = re.match(r"In 'experiment/([^']+)': Could not override '([^']+)'", str(error))
    if foreign:
        choice, group = foreign.groups()
        return ConfigError(
            f"experiment={choice} chooses a {group}, and {stage} has no {group}. "
            "Is the experiment one of another stage?"
        )
    if isinstance(error, MissingConfigException):
        return ConfigError(no_such_choice(error, in_python))
    if isinstance(error, OverrideParseException):
        return ConfigError(_no_override(str(error.override), in_python))
    if isinstance(error, MissingMandatoryValue):
        return ConfigError(f"{stage} needs {error.full_key}=...; {_where(stage, in_python)} says what it is.")
    if isinstance(error, InstantiationException):
        return ConfigError(_not_built(error))
    if str(error).startswith("Ambiguous value"):
        word = str(error).splitlines()[0].removeprefix("Ambiguous value for argument ").strip("'")
        return ConfigError(_ambiguous(word))
    unknown = re.match(r"Could not (?:override|delete from config\.) '([^']+)'", str(error))
    if unknown:
        return ConfigError(no_such_setting(unknown.group(1), _override_in(error), stage, in_python, _composed(error)))
    if chosen_again := _chosen_again(error):
        return ConfigError(chosen_again)
    gone = re.match(r"Key '([^']+)' is not in struct|Interpolation key '([^']+)' not found", str(error))
    if gone:
        return ConfigError(_gone(gone.group(1) or gone.group(2), error, stage))
    return ConfigError(_plain(error))


def _where(stage: str, in_python: bool) -> str:
    """Where settings are described."""
    return "docs/settings.md" if in_python else f"`twbal {stage} --help`"


def unreadable_yaml(error: yaml.YAMLError | UnicodeDecodeError) -> ConfigError:
    """What `error`, raised while Hydra read a configuration, says of the file that cannot be read."""
    if isinstance(error, UnicodeDecodeError):
        return ConfigError(f"{_being_read(error)} is no text in UTF-8 ({error}). Save it as UTF-8.")
    mark = error.problem_mark if isinstance(error, yaml.MarkedYAMLError) else None
    if mark is None:
        return ConfigError(f"{_being_read(error)} cannot be read ({_plain(error)}).")
    what = getattr(error, "problem", None) or "no yaml"
    return ConfigError(
        f"{mark.name} is no yaml: line {mark.line + 1}, column {mark.column + 1}: {what}. "
        "Are brackets closed, blocks indented alike, and is there a blank after each colon?"
    )


def _being_read(error: Exception) -> str:
    """The file in the midst of which an error was raised."""
    found = [
        value
        for frame, _ in traceback.walk_tb(error.__traceback__)
        for name, value in frame.f_locals.items()
        if name in _READING and isinstance(value, str | Path)
    ]
    return str(found[-1]) if found else "A yaml file of the configuration"


def refused_by_hydra(error: ValueError, words: Sequence[str]) -> ConfigError | None:
    """What Hydra cannot read of words, or of a yaml's list `defaults`; None where the error is none of Hydra's.

    One of OmegaConf, as Hydra sets a value by a word, is Hydra's, too.

    Args:
        error: that came out of Hydra.
        words: overrides and flags of the command line.
    """
    frames = [frame for frame, _ in traceback.walk_tb(error.__traceback__)]
    last = frames[-1]
    if last.f_globals["__name__"].startswith("omegaconf."):
        given = [each for frame in frames if isinstance(each := frame.f_locals.get("override"), Override)]
        return ConfigError(_not_in_list(given[-1])) if given else None
    if not last.f_globals["__name__"].startswith("hydra."):
        return None
    if str(error).startswith("Only one of --run"):
        return ConfigError(
            "Only one of -m (--multirun), --run, --cfg, --info and --shell-completion can be given: leave out the "
            "others. For the settings of one job of a sweep give --cfg with the values of that job."
        )
    if str(error).startswith("Config group override must be a string"):
        if any(word.startswith("=") for word in words):
            return ConfigError(
                "A word that begins with = is not an override; expected key=value, without blanks about =."
            )
        override = last.f_locals.get("override")
        group, found = (override.key_or_group, override.input_line) if override else ("A group", "a word")
        return ConfigError(f"{group} is a group, of which a choice is taken by its name; found is {found}.")
    return ConfigError(f"A yaml file of the configuration cannot be read: {error}. {_DEFAULTS}")


def _not_in_list(override: Override) -> str:
    """What is said of a value that is set by its name in a list."""
    part = override.key_or_group.rpartition(".")[0]
    return (
        f"{override.input_line} sets a value by its name, and {part} is a list. Does its yaml file begin with lines "
        "of `- ...` or with a bracket? Expected are lines of `name: value`."
    )


def _own_cause(error: BaseException) -> TwbalError | None:
    """The error of ours that Hydra wrapped, if it was one."""
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, TwbalError):
        cause = cause.__cause__
    return cause


def _no_override(word: str, in_python: bool) -> str:
    key, equals, value = word.partition("=")
    if not equals:
        return f"{word!r} is not an override; expected key=value."
    if value.startswith("~"):
        return f"{word!r} is not an override: ~ stands for your home folder only where a word begins. {HOME}"
    foreign = "".join(dict.fromkeys(letter for letter in word if letter.isalpha() and not letter.isascii()))
    also = f", or with letters such as {foreign}," if foreign else ""
    kept = "" if in_python else " that the shell does not take away"
    return (
        f"{word!r} is not an override: its value cannot be read. Put text with any of = , : ( ) [ ] {{ }}{also} in "
        f"quotes{kept}, as in '{key}=\"text\"', or in a list '{key}=[\"text\"]'."
    )


def _ambiguous(word: str) -> str:
    """What is said of several values without a sweep."""
    key, _, value = word.partition("=")
    point = (
        f"; for a number with a decimal point write {key}={value.replace(',', '.')}" if is_comma_number(value) else ""
    )
    return f"{word!r} has several values. For a list write '{key}=[{value}]', for a sweep over them add -m{point}."


def _composed(error: Exception) -> Mapping[Any, Any]:
    """The configuration, as plain values, to which Hydra could not apply an override; empty where it is not known."""
    found = [
        frame.f_locals.get("cfg")
        for frame, _ in traceback.walk_tb(error.__traceback__)
        if frame.f_globals["__name__"].startswith("hydra.")
    ]
    known = [cfg for cfg in found if isinstance(cfg, DictConfig)]
    tree = OmegaConf.to_container(known[-1]) if known else {}
    return tree if isinstance(tree, dict) else {}


def _override_in(error: Exception) -> str:
    """The override that Hydra says how to write otherwise; "" where it does not."""
    word = re.search(r"^To append to your (?:config|default list) use \+(.*)$", str(error), re.MULTILINE)
    return word.group(1) if word else ""


def _chosen_again(error: Exception) -> str:
    """What is said of a choice that is added by + or ++ to one that there is, and "" of another error."""
    forced = re.match(r"force-add of config groups is not supported: '\+\+(([^=]+)=[^']*)'", str(error))
    if forced:
        return f"{forced.group(2)} is a group, of which a choice is taken without ++: give {forced.group(1)}."
    twice = re.match(r"Multiple values for (\S+)\. |(\S+) appears more than once in the final defaults", str(error))
    if twice:
        group = twice.group(1) or twice.group(2)
        for frame, _ in traceback.walk_tb(error.__traceback__):
            known = frame.f_locals.get("overrides")
            for added in known.append_group_defaults if isinstance(known, Overrides) else ():
                if added.get_override_key() == group:  # or the list `defaults` of a yaml file has it twice
                    return f"There is a {group} already. Choose another one without +: {group}={added.get_name()}."
    return ""


def _gone(key: str, error: Exception, stage: str) -> str:
    """What is said of a setting that another one refers to or a stage reads, and that is not there."""
    place = getattr(error, "full_key", None) or ""
    by = f"{place} refers to ${{{key}}}" if str(error).startswith("Interpolation") else f"{stage} reads {place or key}"
    return f"{by}, which the configuration does not have. Was it taken away by ~{key}, or is it misspelt?"


def _not_built(error: InstantiationException) -> str:
    key = re.search(r"full_key: (\S+)", str(error))
    what = key.group(1) if key else "A part of the configuration"
    cause = error.__cause__
    wrong = _wrong_entries(str(error), str(cause)) if isinstance(cause, TypeError) else ""
    if wrong:
        return f"{what} cannot be built from its settings: it {wrong}"
    nowhere = re.search(r"Error (?:loading|locating target) '([^']+)'", f"{cause}\n{error}")
    if nowhere:
        missing = re.search(r"No module named '[^']+'", f"{cause}")
        return f"{what} {_target_of_nothing(nowhere.group(1), missing.group() if missing else '')}"
    reason = f"{type(cause).__name__}: {cause}" if cause else _plain(error)
    return f"{what} cannot be built from its settings ({reason}). Is each of them of the right kind, and none left out?"


def _target_of_nothing(target: str, reason: str) -> str:
    """What is said of a `_target_` that cannot be loaded."""
    first, blank, rest = target.partition(" ")
    if blank:
        return (
            f"has a second line in its _target_, {rest!r}: yaml takes a line that is indented or has no colon for a "
            f"part of the one before. Write `_target_: {first}`, and below it, without blanks before it, `name: value`."
        )
    why = f" ({reason})" if reason else ""
    return f"has the _target_ {target}, which cannot be loaded{why}. Is it misspelt, or its module not on PYTHONPATH?"


def _wrong_entries(message: str, cause: str) -> str:
    """What is missing of a configuration or too much in it, out of what Python says of a call's arguments; else ""."""
    target = re.search(r"call to target '([^']+)'", message)
    takes = settings_taken(target.group(1)) if target else []
    entries = f"Its entries are: {', '.join(takes)}"
    entries += f" ({target.group(1)} takes these)." if target else "."
    missing = re.search(r"missing \d+ required (?:positional|keyword-only) arguments?: (.*)", cause)
    if missing:
        names = re.findall(r"'([^']+)'", missing.group(1))
        lines = ", ".join(f"`{name}: ...`" for name in names)
        return f"lacks {', '.join(map(repr, names))}: add {lines}. {entries}"
    unknown = re.search(r"unexpected keyword argument '([^']+)'", cause)
    if unknown:
        name = unknown.group(1)
        return f"has no entry {name!r}{guess(name, takes)}: take it out. {entries}"
    return ""


def settings_taken(target: str) -> list[str]:
    """Names of all that a `_target_` takes, but for those that are free; none where they are not known."""
    free = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    try:
        taken = inspect.signature(get_object(target)).parameters.values()
        return [each.name for each in taken if each.name != "self" and each.kind not in free]
    except (ValueError, TypeError, ImportError):  # compiled ones have none
        return []


def _plain(error: Exception) -> str:
    """The message as one line; OmegaConf adds lines of its own bookkeeping that help nobody here."""
    lines = [line.strip() for line in str(error).splitlines()]
    text = "; ".join(line for line in lines if line and not line.startswith("object_type="))
    cause = error.__cause__
    return f"{text} ({_plain(cause)})" if isinstance(cause, OmegaConfBaseException) else text
