"""The robot on the other end of a link: reached, and held against what is to drive it."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import cast

from hydra.core.hydra_config import HydraConfig
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from twbal.cli.console import configuration_flags, say
from twbal.core.channels import Channels
from twbal.core.errors import ConfigError
from twbal.core.robot_parameters import RobotParameters
from twbal.link.protocol import Clock, Sensors
from twbal.link.real_time import punctual
from twbal.link.serial_plant import SerialPlant
from twbal.policies.policy import BoundedPolicy, Policy
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


def check_torque(policy: Policy, robot: RobotParameters) -> None:
    """Raise ConfigError where a policy commands more than the robot of a sheet takes."""
    most = float(policy.max_command) if isinstance(policy, BoundedPolicy) else 0.0
    if not most <= robot.torque_limit * (1 + 1e-9):
        raise ConfigError(
            f"The policy commands up to {most:g} N·m; the robot {robot.name!r} takes "
            f"{robot.torque_limit:g} N·m. Choose the robot that it was made for by robot=..., or make one for it."
        )


def is_beyond(torque: float, limit: float) -> bool:
    """Whether a sheet's torque limit is more than a robot's, by more than single precision rounds [N·m]."""
    return not limit >= torque * (1 - 1e-6)


def check_robot(plant: SerialPlant, robot: RobotParameters) -> None:
    """Raise ConfigError where a robot is not that of the sheet."""
    if not abs(plant.control_period - robot.control_period) <= 1e-6:
        raise ConfigError(
            f"The robot {plant.robot_name!r} on the link has a control period of {plant.control_period} s; the data "
            f"sheet {robot.name!r} says {robot.control_period} s. Is it the right one (robot=...)?"
        )
    if is_beyond(robot.torque_limit, plant.torque_limit):
        raise ConfigError(
            f"The robot {plant.robot_name!r} on the link takes at most {plant.torque_limit:g} N·m; the data sheet "
            f"{robot.name!r} says {robot.torque_limit:g} N·m. Commands beyond would be recorded but not act. Is it the "
            f"right one (robot=...)? Or set robot.torque_limit={plant.torque_limit:g} throughout."
        )


def check_sensors(plant: SerialPlant, channels: Channels) -> None:
    """Raise ConfigError where a robot does not measure what the state needs."""
    for name in ("acceleration", "yaw_rate"):
        if name in channels.names and Sensors[name.upper()] not in plant.sensors:
            raise ConfigError(
                f"The robot {plant.robot_name!r} on the link does not measure its {name.replace('_', ' ')}, which is a "
                "channel of the state. Choose a state without it, such as state=default."
            )


def why_not_turned(plant: SerialPlant) -> str:
    """Why nothing can control the heading of a robot; empty where something can."""
    if not plant.turns:
        return plant.why_straight
    return "" if plant.tells_heading else "it measures neither a yaw rate nor a difference of its wheels"
