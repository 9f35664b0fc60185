"""Which virtual robot a policy was learned on, as the configuration of its run says it."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from hydra import compose
from hydra.errors import HydraException
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from twbal.algorithm.tested_robot import TestedRobot
from twbal.cli.config_check import check_configuration
from twbal.cli.hydra_errors import explained
from twbal.cli.typed_config import with_used_step
from twbal.cli.yaml_data import OF_A_RUN, read_yaml
from twbal.core.errors import ConfigError, DataError
from twbal.virtual_robot.drawn import draw_ground_truth

STAGE = "virtual-robot"
_DECIDE = ("robot", "faults", "start", "physics_step")
"""Settings of `twbal virtual-robot` that decide what its robot does."""
_OF_SERVING = ("clock", "self_stop_tilt", "watchdog", "protocol", "held", "idle_timeout", "firmware", "parent")
"""Those that say how it is served."""
_NAME = re.compile(r"[\w.-]+")
_KEY = re.compile(r"[\w.]+")
_NO_NAME = "${robot.name}"  # as a run keeps it


class FoundRobot(NamedTuple):
    """A virtual robot, and the configuration that describes it.

    Attributes:
        robot: it.
        cfg: of `twbal virtual-robot`.
    """

    robot: TestedRobot
    cfg: DictConfig


def robot_of_run(run: Path) -> FoundRobot:
    """The virtual robot that a run of `twbal iterate` drove. To be called within a stage, or while composing.

    Args:
        run: its folder.

    Raises:
        ConfigError: it was no virtual robot, or one that this twbal cannot make.
        DataError: the folder does not say which robot it was.
    """
    file = run / ".hydra" / "config.yaml"
    try:
        settings = read_yaml(file, OF_A_RUN)
    except FileNotFoundError:
        raise DataError(
            f"{run} does not say which robot its policy was learned on (no .hydra/config.yaml). Give the policy.pt "
            "itself, and the robot by robot=... and link.seed=..."
        ) from None
    link = settings.get("link") if isinstance(settings, dict) else None
    if not isinstance(link, dict):
        raise DataError(f"{file} has no link. Is {run} a run folder of `twbal iterate`?")
    if "seed" not in link or "overrides" not in link:
        raise ConfigError(
            f"The robot of {run} was not a virtual one (link.port={link.get('port')}); only a virtual robot can be "
            "changed. Leave the run out, or give its policy.pt, and the virtual robot by robot=... link.seed=..."
        )
    sheet = settings.get("robot")
    name = sheet.get("name") if isinstance(sheet, dict) and link.get("robot") == _NO_NAME else link.get("robot")
    return _virtual_robot(str(name), str(link["seed"]), _listed(link["overrides"]), str(file))


def robot_of_link(cfg: DictConfig) -> FoundRobot:
    """The virtual robot that `robot` and `link` of a stage choose. To be called within a stage, or while composing.

    Raises:
        ConfigError: the link is to no virtual robot.
    """
    if "overrides" not in cfg.link:
        raise ConfigError("Only a virtual robot can be changed: choose link=virtual, and the robot by link.seed=...")
    return _virtual_robot(str(cfg.link.robot), str(cfg.link.seed), _listed(cfg.link.overrides), "link.overrides")


def _listed(overrides: Any) -> list[str]:
    return [str(word) for word in overrides or ()]


def _virtual_robot(name: str, seed: str, overrides: Sequence[str], source: str) -> FoundRobot:
    """The robot that `twbal virtual-robot` would serve.

    Args:
        name: of its data sheet.
        seed: of what it hides.
        overrides: further settings of the stage; from a file that may come from anyone.
        source: where these stand, for messages.
    """
    if not _NAME.fullmatch(name) or not seed.isdecimal():
        raise ConfigError(f"{source} says robot {name[:40]!r} and seed {seed[:40]!r}; expected a name and a number.")
    words = [f"robot={name}", f"seed={seed}", *(word for word in overrides if _decides(word, source))]
    try:
        cfg = compose("virtual_robot", words)
        check_configuration(cfg, STAGE)
    except (HydraException, OmegaConfBaseException) as error:
        raise explained(error, STAGE) from error
    sheet = instantiate(cfg.robot)
    truth = draw_ground_truth(instantiate(cfg.faults), sheet, cfg.seed)
    return FoundRobot(TestedRobot(sheet, truth, instantiate(cfg.start), cfg.physics_step, cfg.seed), cfg)


def _decides(word: str, source: str) -> bool:
    """Whether an override decides what the robot does, and not only how it is served.

    Raises:
        ConfigError: it may name code, or is of neither kind.
    """
    key, _, value = word.partition("=")
    first = key.partition(".")[0]
    if not _KEY.fullmatch(key) or "_target_" in word or "$" in value or first not in (*_DECIDE, *_OF_SERVING):
        raise ConfigError(
            f"{source} has {word[:60]!r} for its virtual robot, which is not taken here. Expected are settings of "
            f"{', '.join(_DECIDE)}, such as faults=moderate."
        )
    return first in _DECIDE


def described(cfg: DictConfig) -> Mapping[str, Any]:
    """What of the configuration of `twbal virtual-robot` decides what its robot does, as plain values."""
    plain = OmegaConf.to_container(cfg, resolve=True)
    assert isinstance(plain, dict)
    return {key: with_used_step(plain)[key] for key in (*_DECIDE, "seed")}
