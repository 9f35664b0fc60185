"""Turns what Hydra and OmegaConf complain of into one clear error."""

import difflib
import inspect
import re
import traceback
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import yaml
from hydra import compose
from hydra.core.global_hydra import GlobalHydra
from hydra.errors import HydraException, InstantiationException, MissingConfigException, OverrideParseException
from hydra.utils import get_object
from omegaconf import OmegaConf
from omegaconf.errors import MissingMandatoryValue, OmegaConfBaseException

from twbal.cli.composition import composing
from twbal.cli.refused_words import HOME
from twbal.cli.settings.comma_number import is_comma_number
from twbal.cli.settings.nested_settings import ancestors, flattened
from twbal.cli.settings.renamed import CHOICES, CHOICES_INSTEAD, name_now, renamed
from twbal.core.errors import ConfigError, TwbalError, install_advice

_EFFECTS = "sim.effects."
_DEFAULTS = "Expected is a list, as in `defaults: [base, {robot: paper}, _self_]`."
_SIMULATIONS = "sim/"
_POLICY = "policy"
_HYDRAS_OWN = re.compile(r"_[a-z]+_")
_PLUGINS = ("hydra/launcher", "hydra/sweeper", "hydra/sweeper/sampler")


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
        return ConfigError(_no_such_choice(error, in_python))
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
        return ConfigError(_no_such_key(unknown.group(1), stage, in_python))
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
        return ConfigError(f"A yaml file of the configuration is no text in UTF-8 ({error}). Save it as UTF-8.")
    mark = error.problem_mark if isinstance(error, yaml.MarkedYAMLError) else None
    if mark is None:
        return ConfigError(f"A yaml file of the configuration cannot be read ({_plain(error)}).")
    what = getattr(error, "problem", None) or "no yaml"
    return ConfigError(
        f"{mark.name} is no yaml: line {mark.line + 1}, column {mark.column + 1}: {what}. "
        "Are brackets closed, blocks indented alike, and is there a blank after each colon?"
    )


def refused_by_hydra(error: ValueError, words: Sequence[str]) -> ConfigError | None:
    """What Hydra cannot read of words, or of a yaml's list `defaults`; None where the error is none of Hydra's.

    Args:
        error: that came out of Hydra.
        words: overrides and flags of the command line.
    """
    *_, (last, _) = traceback.walk_tb(error.__traceback__)
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


def _own_cause(error: BaseException) -> TwbalError | None:
    """The error of ours that Hydra wrapped, if it was one."""
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, TwbalError):
        cause = cause.__cause__
    return cause


def _no_such_choice(error: MissingConfigException, in_python: bool) -> str:
    group, _, choice = (error.missing_cfg_file or "").rpartition("/")
    error.options = error.options or _choices_of(group)  # Hydra has none where several were chosen: group=[a,b]
    if not group or not error.options:
        return _line(error, 0)
    now = CHOICES.get(group, {}).get(choice)
    if now is not None:
        return f"{group} has no choice {choice!r} any more: it is called {now!r} now."
    instead = CHOICES_INSTEAD.get(group, {}).get(choice)
    if instead is not None:
        return f"{group} has no choice {choice!r} any more: {instead}."
    more = f" Others come with {install_advice('sweeps')}." if group in _PLUGINS else ""
    for file in sorted(Path.cwd().glob(f"*/{group}/{choice}.yaml"))[:1]:
        folder = file.relative_to(Path.cwd()).parts[0]
        more += f" There is one in the folder {folder}: {_of_folder(group, choice, folder, in_python)}."
    if group.split("/")[0] == _POLICY:
        given = f"{group}/{choice}".removeprefix(f"{_POLICY}/")
        group = _POLICY
        if Path(given).exists():
            more += f" Is the file or run folder {given} meant? Give {_POLICY}=saved {_POLICY}.path={given}."
    if group.startswith(_SIMULATIONS):
        more += f" Nor is there a file or run folder {group.removeprefix(_SIMULATIONS)}/{choice}."
    return (
        f"{group} has no choice {choice!r}{_guess(choice, error.options)}. "
        f"The choices are: {', '.join(error.options)}.{more}"
    )


def _choices_of(group: str) -> list[str]:
    """All choices of a group of twbal's; none where it has no such group."""
    with composing():
        return GlobalHydra.instance().config_loader().get_group_options(group) if group else []


def _of_folder(group: str, choice: str, folder: str, in_python: bool) -> str:
    """How a choice in a folder of one's own is chosen."""
    if not in_python:
        return f"add --config-dir={folder}"
    if group == "robot":
        return f"give its path, '{folder}/robot/{choice}.yaml', in place of the name"
    return f"add 'hydra.searchpath=[{folder}]' to the overrides"


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


def _no_such_key(key: str, stage: str, in_python: bool) -> str:
    with composing():
        cfg = compose(stage.replace("-", "_"))
    tree = OmegaConf.to_container(cfg)
    assert isinstance(tree, dict)
    leaves = dict(flattened(tree))
    known = list(dict.fromkeys(part for leaf in leaves for part in (*ancestors(leaf), leaf)))
    if key in known and isinstance(leaves.get(key, {}), dict):
        return f"{stage} cannot set {key} to that: it has no such entries. New ones are added by +{key}.<name>=..."
    if key in leaves:
        return (
            f"{stage} has the setting {key}, but not with what was chosen here: an experiment or a choice of a group "
            f"has other settings in its place. {_shown(stage, in_python)} with the same choices shows which."
        )
    now = name_now(key)
    if now in known:
        return f"{stage} {renamed(key, now)}"
    if key.startswith(_EFFECTS) and "sim" in cfg:
        name = key.removeprefix(_EFFECTS).split(".")[0]
        return f"The simulation has no effect {name!r} to set {key} of. Add it by +effect@{_EFFECTS}{name}={name}."
    with_it = _choices_with(key, stage)
    if with_it:
        return f"{stage} has the setting {key} only with {' or '.join(with_it)}: add that."
    top = ", ".join(str(name) for name in cfg)
    guess = _guess(key, known)
    return f"{stage} has no setting {key!r}{guess}. Its settings are: {top}; {_shown(stage, in_python)} shows all."


def _choices_with(key: str, stage: str) -> list[str]:
    """Choices of the group that a setting is in by its name, with which a stage has that setting, as group=choice."""
    group, found = key.split(".")[0], []
    for choice in _choices_of(group):
        with composing(), suppress(HydraException, OmegaConfBaseException):  # of a group that the stage does not have
            tree = OmegaConf.to_container(compose(stage.replace("-", "_"), [f"{group}={choice}"]))
            if isinstance(tree, dict) and key in dict(flattened(tree)):
                found.append(f"{group}={choice}")
    return found


def _gone(key: str, error: Exception, stage: str) -> str:
    """What is said of a setting that another one refers to or a stage reads, and that is not there."""
    place = getattr(error, "full_key", None) or ""
    by = f"{place} refers to ${{{key}}}" if str(error).startswith("Interpolation") else f"{stage} reads {place or key}"
    return f"{by}, which the configuration does not have. Was it taken away by ~{key}, or is it misspelt?"


def _shown(stage: str, in_python: bool) -> str:
    """What shows the settings of a stage."""
    return f"`twbal {stage} --cfg job`{', on the command line,' * in_python}"


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
    takes = _arguments(target.group(1)) if target else []
    missing = re.search(r"missing \d+ required (?:positional|keyword-only) arguments?: (.*)", cause)
    if missing:
        names = re.findall(r"'([^']+)'", missing.group(1))
        lines = ", ".join(f"`{name}: ...`" for name in names)
        return f"lacks {', '.join(map(repr, names))}: add {lines}. Its entries are: {', '.join(takes)}."
    unknown = re.search(r"unexpected keyword argument '([^']+)'", cause)
    if unknown:
        name = unknown.group(1)
        return f"has no entry {name!r}{_guess(name, takes)}: take it out. Its entries are: {', '.join(takes)}."
    return ""


def _arguments(target: str) -> list[str]:
    """Names of all that a `_target_` takes."""
    try:
        return [name for name in inspect.signature(get_object(target)).parameters if name != "self"]
    except (ValueError, TypeError):  # compiled ones have none
        return []


def _guess(word: str, known: Sequence[str]) -> str:
    """The known name that is likeliest meant: one of the same last part, one that is alike, or one whose last part is.

    Hydra's own keys, such as `_target_`, are none that a person means.
    """
    ends: dict[str, list[str]] = {}
    for name in sorted(known, key=_depth):
        if not _HYDRAS_OWN.fullmatch(end := name.split(".")[-1]):
            ends.setdefault(end, []).append(name)
    last = word.split(".")[-1]
    near = difflib.get_close_matches(word, ends.get(last, []), n=1, cutoff=0.0)
    near = near or difflib.get_close_matches(word, [name for names in ends.values() for name in names], n=1)
    near = near or [ends[end][0] for end in difflib.get_close_matches(last, ends, n=1)]
    return f" (did you mean {near[0]!r}?)" if near else ""


def _depth(name: str) -> int:
    return name.count(".")


def _line(error: Exception, index: int) -> str:
    lines = str(error).splitlines() or [""]
    return lines[min(index, len(lines) - 1)].strip()


def _plain(error: Exception) -> str:
    """The message as one line; OmegaConf adds lines of its own bookkeeping that help nobody here."""
    lines = [line.strip() for line in str(error).splitlines()]
    text = "; ".join(line for line in lines if line and not line.startswith("object_type="))
    cause = error.__cause__
    return f"{text} ({_plain(cause)})" if isinstance(cause, OmegaConfBaseException) else text
