"""Refuses a configuration that cannot be right before anything runs."""

import difflib
import json
from collections.abc import Mapping
from typing import Any

from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from twbal.cli.settings.lookup import Table, is_known, leaves
from twbal.cli.settings.validate import check
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

FIND_THEIR_STEP = ("diagnose", "evaluate-sim")
"""Stages that find a physics step which divides the control period of the logs."""


def refuse_unread(cfg: DictConfig, stage: str) -> None:
    """Refuse a part of the configuration, as `+sede=3` adds it, that neither the stage nor a setting of it refers to.

    Args:
        cfg: of the stage.
        stage: its name on the command line.

    Raises:
        ConfigError: there is one.
    """
    table, names = Table(stage, {}), [str(name) for name in cfg if name != "hydra"]
    for name in names:
        if not table.row(name) and not table.has_parts(name) and f"${{{name}" not in OmegaConf.to_yaml(cfg):
            near = difflib.get_close_matches(name, [other for other in names if other != name], n=1)
            guess = f" Is {near[0]} meant?" if near else ""
            raise ConfigError(
                f"{stage} has no setting {name!r}, and none of its settings refers to it as ${{{name}}}.{guess}"
            )


def check_configuration(cfg: DictConfig, stage: str) -> None:
    """Hold every setting against the table, and related ones against each other.

    Args:
        cfg: of the stage; what Hydra keeps of itself in it is left alone.
        stage: its name on the command line.

    Raises:
        ConfigError: a setting cannot be right, or was not given.
        OmegaConfBaseException: a setting refers to one that there is not.
    """
    own = OmegaConf.masked_copy(cfg, [str(name) for name in cfg if name != "hydra"]) if "hydra" in cfg else cfg
    try:
        plain = OmegaConf.to_container(own, resolve=True)
    except OmegaConfBaseException:  # of a value that refers to the robot: say what is wrong with its sheet
        robot = own.get("robot")
        if isinstance(robot, DictConfig) and "_target_" in robot:
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
    robot = own.get("robot")
    if isinstance(robot, DictConfig) and "_target_" not in robot:
        raise ConfigError(
            f"The sheet of robot {robot.get('name')!r} lacks its first entry. "
            "Add `_target_: twbal.core.robot_sheet.robot_sheet`."
        )
    for place in _HOLD_RULES:
        node = OmegaConf.select(own, place)
        values = json.dumps(_at(tree, place), default=str)
        if isinstance(node, DictConfig) and (place, values) not in _built:
            _build(node)
            _built.add((place, values))
    if stage not in FIND_THEIR_STEP:
        _check_step(own)


def _check_step(cfg: DictConfig) -> None:
    """Whether the physics step divides the control period."""
    from twbal.core.engine import substeps  # here, as help needs none of the simulation

    step, period = OmegaConf.select(cfg, "sim.physics_step"), OmegaConf.select(cfg, "robot.control_period")
    if step is not None and period is not None:
        substeps(period, step)


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
