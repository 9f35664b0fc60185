"""The robot on the other end of a link: reached, and held against what is to drive it."""

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import cast

from hydra.core.hydra_config import HydraConfig
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from twbal.cli.console import configuration_flags, say
from twbal.link.protocol import Clock
from twbal.link.real_time import punctual
from twbal.link.serial_plant import SerialPlant
from twbal.virtual_robot.process import Launch, settings_of, virtual_robot_command


def robot_link(link: DictConfig, launch: Launch) -> AbstractContextManager[SerialPlant]:
    """The link, not opened yet; a virtual robot finds the configuration that this run was given by its flags."""
    if "overrides" not in link:
        return cast(AbstractContextManager[SerialPlant], instantiate(link))
    virtual = instantiate(link, overrides=_overrides(link), _partial_=True)
    return cast(AbstractContextManager[SerialPlant], virtual(launch=launch))


def virtual_command(link: DictConfig) -> list[str]:
    """The command by which `robot_link` launches the virtual robot of a link."""
    return virtual_robot_command(settings_of(link.robot, link.seed, link.clock, _overrides(link), link.get("program")))


def _overrides(link: DictConfig) -> list[str]:
    flags = configuration_flags() if HydraConfig.initialized() else []
    return [*flags, *link.overrides]


def with_own_sheet(cfg: DictConfig, words: Sequence[str]) -> DictConfig:
    """The same configuration, but its virtual robot, a process of its own, is told the values of a sheet.

    Args:
        cfg: of a stage with a link, which may be one to a port.
        words: overrides that put these values in the place of those of the packaged robot `paper`.
    """
    if "overrides" not in cfg.link:
        return cfg
    changed = OmegaConf.merge(cfg, {"link": {"robot": "paper", "overrides": [*words, *cfg.link.overrides]}})
    assert isinstance(changed, DictConfig)
    return changed


def commanded_from_here(link: DictConfig) -> DictConfig:
    """The same link, whatever is on board of the robot."""
    changed = OmegaConf.merge(link, {"on_board": False} if "on_board" in link else {})
    assert isinstance(changed, DictConfig)
    return changed


@contextmanager
def in_time(plant: SerialPlant) -> Iterator[None]:
    """Answer a robot in real time as fast as this computer can; where it may not have priority, that is said.

    A robot in lockstep waits for its host, which then is a program as any other.
    """
    if plant.clock is Clock.LOCKSTEP:
        yield
        return
    with punctual() as has_priority:
        if not has_priority:
            say("this command has no real-time priority, so a busy computer makes it late; see `twbal doctor`")
        yield


def why_not_turned(plant: SerialPlant) -> str:
    """Why nothing can control the heading of a robot; empty where something can."""
    if not plant.turns:
        return plant.why_straight
    return "" if plant.tells_heading else "it measures neither a yaw rate nor a difference of its wheels"
