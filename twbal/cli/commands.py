"""Stage commands that one stage runs for another: composed as the command line composes them, and written down."""

import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from copy import deepcopy
from functools import lru_cache
from numbers import Integral, Real
from pathlib import Path
from typing import Any

from hydra import compose
from hydra.core.config_loader import ConfigLoader
from hydra.core.global_hydra import GlobalHydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import ChoiceSweep, Override, OverrideType, QuotedString
from hydra.errors import HydraException
from omegaconf import DictConfig, OmegaConf, open_dict
from omegaconf.errors import OmegaConfBaseException

from twbal.cli.settings.nested_settings import flattened
from twbal.core.errors import ConfigError

ROOT = Path("$OUT")  # stands for the run folder in commands that are written down
_PLAIN = re.compile(r"[A-Za-z_./]([\w./:@ -]*[\w./:@-])?")  # blanks within it are kept
_OTHER_THAN_TEXT = ("null", "true", "false", "nan", "inf")


def compose_stage(stage: str, overrides: Sequence[str]) -> DictConfig:
    """The configuration that `twbal <stage> <overrides>` runs with. To be called within a stage.

    Hydra composes once for each choice of groups, which takes a fifth of a second; values are set in a copy.

    Args:
        stage: its name on the command line.
        overrides: key=value, as on the command line.
    """
    loader = GlobalHydra.instance().config_loader()
    try:
        values, others = _values_apart(loader, _composed(loader, stage, ()), overrides)
        cfg = deepcopy(_own_part(loader, stage, others))
        for each in values:
            OmegaConf.update(cfg, each.key_or_group, each.value(), merge=True, force_add=each.is_force_add())
    except (HydraException, OmegaConfBaseException):
        return compose(_config_name(stage), list(overrides))  # where it cannot either, it says why
    return cfg


def refuse_experiment_of_another_stage(stage: str, choices: Mapping[str, str]) -> None:
    """Check that the chosen experiment, if one is, sets nothing that the stage does not have. To be called within it.

    Args:
        stage: its name on the command line.
        choices: which choice it has of each group, as in Hydra's `runtime.choices`.

    Raises:
        ConfigError: it does.
    """
    choice = choices.get("experiment")
    if choice is None:
        return
    own, with_it = compose_stage(stage, []), compose_stage(stage, [f"experiment={choice}"])
    unknown = [str(key) for key in with_it if key not in own]
    if unknown == ["experiment"]:
        raise ConfigError(
            f"experiment={choice} sets nothing of {stage}: its first line has to be `# @package _global_`, and "
            "settings have to follow."
        )
    if unknown:
        raise ConfigError(
            f"experiment={choice} sets {', '.join(unknown)}, and {stage} has no such setting. Is the experiment one of "
            f"another stage? `twbal {stage} --cfg job` shows what this one has."
        )


def stage_overrides(
    stage: str, whole: Mapping[str, Any], choices: Mapping[str, str], overrides: Sequence[str]
) -> list[str]:
    """The overrides with which `stage` runs as another one says, and nothing beside what differs from its own defaults.

    What the stage's settings are is looked up in this order: `overrides`; the section of `whole` that has the stage's
    name (with underscores); the top level of `whole`; the stage's own default. A group that the stage chooses nothing
    of (`experiment`) is no part of a configuration but a list of overrides, and `whole` has what they came to.

    Args:
        stage: its name on the command line.
        whole: configuration of the stage that asks, with the groups that both share, as `tree_of` has it.
        choices: which choice that has of each group, as in Hydra's `runtime.choices`.
        overrides: that come before all else.
    """
    decided = {re.split(r"[@=]", word.lstrip("+~"), maxsplit=1)[0] for word in overrides}
    loader = GlobalHydra.instance().config_loader()
    groups = _composed(loader, stage, ()).hydra.runtime.choices
    chosen = [
        f"{group}={choices[group]}"
        for group, own in groups.items()
        if own is not None
        and choices.get(group, own) != own
        and not group.startswith("hydra/")
        and group not in decided
    ]
    base = _own_tree(loader, stage, tuple(chosen))
    section = whole.get(_config_name(stage))
    known = {**whole, **(section if isinstance(section, dict) else {})}
    shared = [key for key in base if key in known]
    wanted, default = (_undecided({name: tree[name] for name in shared}, decided) for tree in (known, base))
    changed = [
        f"{'' if key in default else '++'}{key}={text(value)}"
        for key, value in wanted.items()
        if key not in default or value != default[key]
    ]
    gone = [f"~{key}" for key in default if not _any_overlap(key, wanted)]
    return [*chosen, *changed, *gone, *overrides]


def command_line(stage: str, overrides: Sequence[str], out: Path) -> str:
    """The shell command that runs `stage` with these overrides into the folder `out`.

    A path that begins with `ROOT` stays a variable of the shell.
    """
    return " ".join(["twbal", stage, *map(_shell_word, [*overrides, f"hydra.run.dir={text(str(out))}"])])


def text(value: Any) -> str:
    """A value as the right-hand side of an override that Hydra reads back as the same value."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Integral):  # also those of NumPy, whose own repr names their type
        return repr(int(value))
    if isinstance(value, Real):
        return repr(float(value))
    if isinstance(value, list):
        return f"[{','.join(map(text, value))}]"
    if isinstance(value, dict):
        return "{" + ",".join(f"{key}:{text(inner)}" for key, inner in value.items()) + "}"
    if value.startswith("${") or (_PLAIN.fullmatch(value) and value.lower() not in _OTHER_THAN_TEXT):
        return str(value)
    escaped = re.sub(r"(\\*)'", r"\1\1\\'", re.sub(r"(\\+)$", r"\1\1", value))
    return f"'{escaped}'"


@lru_cache(maxsize=1024)
def parsed(word: str) -> Override | None:
    """An override, read by Hydra's grammar, which takes milliseconds; None where it cannot be: Hydra says later why."""
    with suppress(HydraException):
        return OverridesParser.create().parse_override(word)
    return None


def swept(word: str) -> list[str]:
    """The values of an override that are separated by commas, as a sweep takes them; none where there is a single one.

    Hydra says later what it cannot read.
    """
    value = override.value() if "," in word and (override := parsed(word)) else None
    if isinstance(value, ChoiceSweep):
        return [each.text if isinstance(each, QuotedString) else str(each) for each in value.list]
    return []


@lru_cache(maxsize=64)
def _composed(loader: ConfigLoader, stage: str, overrides: tuple[str, ...]) -> DictConfig:
    """A configuration with what Hydra keeps in it, composed once in a command: each has a loader of its own."""
    return compose(_config_name(stage), list(overrides), return_hydra_config=True)


@lru_cache(maxsize=64)
def _own_part(loader: ConfigLoader, stage: str, overrides: tuple[str, ...]) -> DictConfig:
    """A configuration without what Hydra keeps in it; not to be changed."""
    cfg = _composed(loader, stage, overrides).copy()
    with open_dict(cfg):
        del cfg["hydra"]
    return cfg


@lru_cache(maxsize=64)
def _own_tree(loader: ConfigLoader, stage: str, overrides: tuple[str, ...]) -> dict[str, Any]:
    """The same as `tree_of` has it; not to be changed."""
    return tree_of(_own_part(loader, stage, overrides))


def _values_apart(
    loader: ConfigLoader, cfg: DictConfig, overrides: Sequence[str]
) -> tuple[list[Override], tuple[str, ...]]:
    """The overrides that set values within what a configuration has, and the others: choices, additions, deletions.

    None is apart where additions and deletions touch the same values: their order then matters. That of choices does
    not, as Hydra takes them first. Nor is any where one cannot be read, of which Hydra tells.
    """
    read = [override for word in overrides if (override := parsed(word))]
    sets = [_sets_a_value(loader, cfg, each) for each in read]
    values, others = ([each for each, does in zip(read, sets, strict=True) if does is of] for of in (True, False))
    ordered = [each.key_or_group for each in others if not _chooses(loader, each)]
    if len(read) < len(overrides) or any(_any_overlap(each.key_or_group, ordered) for each in values):
        return [], tuple(overrides)
    return values, tuple(word for word, does in zip(overrides, sets, strict=True) if not does)


def _sets_a_value(loader: ConfigLoader, cfg: DictConfig, override: Override) -> bool:
    """Whether it sets a value of the stage, or within a part of it; those that come to several values do not."""
    top = override.key_or_group.partition(".")[0]
    is_plain = override.type in (OverrideType.CHANGE, OverrideType.FORCE_ADD) and override.package is None
    is_of_stage = top != "hydra" and top in cfg.keys()  # noqa: SIM118, which has what is ???, too
    return is_plain and is_of_stage and not override.is_sweep_override() and not _chooses(loader, override)


def _chooses(loader: ConfigLoader, override: Override) -> bool:
    """Whether it chooses of a group, by Hydra's rule."""
    return bool(loader.get_group_options(override.key_or_group)) and not isinstance(override.value(), dict)


def _shell_word(word: str) -> str:
    if str(ROOT) not in word:
        return shlex.quote(word)
    return '"' + re.sub(r'(["\\`])', r"\\\1", word) + '"'


def _undecided(tree: Mapping[str, Any], decided: Iterable[str]) -> dict[str, Any]:
    """The values of a configuration by dotted key, but for those that overrides have decided."""
    return {key: value for key, value in flattened(tree) if not _any_overlap(key, decided)}


def _any_overlap(key: str, others: Iterable[str]) -> bool:
    """Whether a dotted key is one of the others, or one of them lies within the other."""
    return any(f"{key}.".startswith(f"{other}.") or f"{other}.".startswith(f"{key}.") for other in others)


def _config_name(stage: str) -> str:
    return stage.replace("-", "_")


def tree_of(cfg: DictConfig) -> dict[str, Any]:
    """`cfg` as plain dicts and lists, with its interpolations as they are written."""
    tree = OmegaConf.to_container(cfg)
    assert isinstance(tree, dict)
    return {str(key): value for key, value in tree.items() if key != "hydra"}
