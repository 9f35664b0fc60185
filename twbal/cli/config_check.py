"""Refuses a configuration that cannot be right before anything runs."""

import difflib
import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

from hydra.conf import HydraConf
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from twbal.cli.commands import compose_stage
from twbal.cli.effect_check import check_effects
from twbal.cli.hydra_errors import settings_taken
from twbal.cli.robot_words import sheet_of
from twbal.cli.settings.lookup import OURS, Table, is_known, leaves
from twbal.cli.settings.validate import check
from twbal.cli.unknown_choice import choices_of
from twbal.cli.unknown_setting import is_of_virtual_robot, no_such_setting, said_of_virtual_robot
from twbal.core.errors import ConfigError

_MISSING = "???"
_HOLD_RULES = (
    "robot",
    "start",
    "state",
    "success",
    "validation",
    "faults",
    "perturbation",
    "agent",
    "sim.effects",
    "ensemble",
)
"""Parts that are built at once, for the rules between their values; they are plain values, and read no files."""
_built: set[tuple[str, str]] = set()
"""Parts that were built already in this process, and so are right: the stages of a run have most in common."""


def refuse_unread(cfg: DictConfig, stage: str, words: Sequence[str]) -> None:
    """Refuse a part of the configuration, as `+sede=3` adds it, that neither the stage nor a setting of it refers to.

    To be called within the stage.

    Args:
        cfg: of the stage.
        stage: its name on the command line.
        words: overrides with which it was called.

    Raises:
        ConfigError: there is one.
    """
    table, names = Table(stage, {}), [str(name) for name in cfg if name != "hydra"]
    added = {_part_of(word): word for word in words if word.startswith("+")}
    own = set(compose_stage(stage, [])) if any(name in added for name in names) else set(names)
    for name in names:
        is_known_here = table.row(name) or table.has_parts(name)
        if (is_known_here and (name in own or name not in added)) or f"${{{name}" in OmegaConf.to_yaml(cfg):
            continue
        others = [other for other in names if other != name]
        if name in added and "link" in cfg and is_of_virtual_robot(name, others):
            raise ConfigError(f"{stage} does not read {name!r}. {said_of_virtual_robot(added[name].lstrip('+'))}")
        near = difflib.get_close_matches(name, others, n=1)
        guess = f" Is {near[0]} meant?" if near else ""
        raise ConfigError(
            f"{stage} has no setting {name!r}, and none of its settings refers to it as ${{{name}}}.{guess}"
        )


def check_configuration(cfg: DictConfig, stage: str, hydra: HydraConf | None = None) -> None:
    """Hold every setting against the table, and related ones against each other.

    Args:
        cfg: of the stage; what Hydra keeps of itself in it is left alone.
        stage: its name on the command line.
        hydra: what Hydra keeps of itself, by which the robot's sheet is named; None: it is not named.

    Raises:
        ConfigError: a setting cannot be right, or was not given.
        OmegaConfBaseException: a setting refers to one that there is not.
    """
    own = OmegaConf.masked_copy(cfg, [str(name) for name in cfg if name != "hydra"]) if "hydra" in cfg else cfg
    _refuse_names_of_choices(own, stage)
    _check_sheet(own, stage, hydra)
    try:
        plain = OmegaConf.to_container(own, resolve=True)
    except OmegaConfBaseException:  # of a value that refers to the robot: say what is wrong with its sheet
        robot = own.get("robot")
        if isinstance(robot, DictConfig):
            check(stage, {"robot": OmegaConf.to_container(robot, resolve=True)})
            _build(robot)
        raise
    assert isinstance(plain, dict)
    tree = {str(name): value for name, value in plain.items()}
    check(stage, _without_missing(tree))
    absent = [leaf.key for leaf in leaves(tree) if leaf.value == _MISSING]
    if of_mapping := [key for key in absent if key.startswith("import.")]:
        raise ConfigError(f"The mapping has ??? for {', '.join(of_mapping)}: fill these in, or write null.")
    if absent:
        raise ConfigError(f"{stage} needs {absent[0]}=...; `twbal {stage} --help` says what it is.")
    _check_link(own, stage, in_python=hydra is None)
    for place in _HOLD_RULES:
        node = OmegaConf.select(own, place)
        values = json.dumps(_at(tree, place), default=str)
        if isinstance(node, DictConfig) and (place, values) not in _built:
            _build(node)
            _built.add((place, values))
    if stage == "iterate":
        _check_horizon(own)
    check_effects(own)


def _part_of(word: str) -> str:
    """The part of the configuration that `+part.setting=...` or `+group@part.setting=choice` is for."""
    key, _, package = word.lstrip("+").partition("=")[0].partition("@")
    return re.split(r"[./]", package or key, maxsplit=1)[0]


def _refuse_names_of_choices(cfg: DictConfig, stage: str) -> None:
    """Refuse the name of a choice in the place of what it stands for, as `robot: lego` in an experiment."""
    table = Table(stage, {})
    for name in map(str, cfg):
        if not table.has_parts(name) or table.row(name) or name not in cfg or OmegaConf.is_interpolation(cfg, name):
            continue
        value = cfg[name]
        if isinstance(value, str) and choices_of(name):
            raise ConfigError(
                f"{stage} cannot have the text {value!r} as {name}; expected settings of its own. A choice of a group "
                f"is taken by {name}={value} on the command line, and in a yaml file, such as an experiment, by "
                f"`defaults: [{{override /{name}: {value}}}]` above the settings."
            )


def _check_sheet(cfg: DictConfig, stage: str, hydra: HydraConf | None) -> None:
    """Refuse what is no sheet of a robot, before anything refers to its values."""
    robot = cfg.get("robot")
    if "robot" not in cfg or (isinstance(robot, DictConfig) and "_target_" in robot):
        return
    if robot is None:
        raise ConfigError(f"{stage} cannot have robot=null; expected is a robot, chosen by robot=<name>.")
    path = sheet_of(hydra) if hydra is not None else None
    sheet = "The sheet of the robot" if path is None else f"The robot sheet {path}"
    if isinstance(robot, DictConfig) and len(robot) > 0:
        raise ConfigError(f"{sheet} lacks its first entry. Add `_target_: twbal.core.robot_sheet.robot_sheet`.")
    found = "is empty" if robot == {} else "holds no values by name"
    raise ConfigError(
        f"{sheet} {found}; expected are lines such as `body_mass: 1.09`. Copy conf/robot/paper.yaml, or let "
        "`twbal new-robot` write a sheet."
    )


def _check_link(cfg: DictConfig, stage: str, in_python: bool) -> None:
    """Refuse a setting that the chosen link does not have: a link is made only once a robot is to be reached."""
    link = cfg.get("link")
    if not isinstance(link, DictConfig) or not str(link.get("_target_", "")).startswith(OURS):
        return
    taken = settings_taken(str(link["_target_"]))
    for name in map(str, link):
        if taken and name not in taken and not name.startswith("_"):
            raise ConfigError(no_such_setting(f"link.{name}", "", stage, in_python))


def _check_horizon(cfg: DictConfig) -> None:
    """Whether trials last as long as the horizon over which their costs are summed."""
    from twbal.core.evaluation import check_horizon  # here, as help needs no numbers

    horizon = OmegaConf.select(cfg, "search.horizon")
    if horizon is not None:
        check_horizon(instantiate(cfg.success), horizon)


def _at(tree: Any, place: str) -> Any:
    """What lies at a dotted key; None where nothing does."""
    for name in place.split("."):
        tree = tree.get(name) if isinstance(tree, dict) else None
    return tree


def _build(node: DictConfig) -> None:
    """Build what of `node` is of twbal."""
    if "_target_" in node:
        if is_known(str(node["_target_"])):
            instantiate(node)
    else:
        for name in node:
            if isinstance(node[name], DictConfig):
                _build(node[name])


def _without_missing(tree: Mapping[Any, Any]) -> dict[str, Any]:
    """The values that were given."""
    return {
        str(name): _without_missing(value) if isinstance(value, dict) else value
        for name, value in tree.items()
        if value != _MISSING
    }
