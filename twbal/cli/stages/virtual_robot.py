"""A robot with hidden faults behind a port."""

import os
import sys
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.cli.console import say
from twbal.cli.typed_config import typed
from twbal.core.errors import ConfigError
from twbal.core.robot_parameters import RobotParameters
from twbal.core.streams import Stream, child_seed
from twbal.link.protocol import VERSION, Clock
from twbal.link.real_time import uncollected
from twbal.virtual_robot.drawn import draw_ground_truth
from twbal.virtual_robot.firmware import Identity
from twbal.virtual_robot.held_robot import KEYS, HeldRobot, Keys
from twbal.virtual_robot.mujoco_robot import MujocoRobot
from twbal.virtual_robot.posix_firmware import serve_firmware
from twbal.virtual_robot.server import ended_by_signals, serve


@dataclass(frozen=True)
class Settings:
    """See conf/virtual_robot.yaml."""

    seed: int
    clock: str
    physics_step: float
    self_stop_tilt: float
    watchdog: float
    protocol: int
    held: bool
    idle_timeout: float
    parent: int | None
    firmware: str | None


def main(cfg: DictConfig) -> None:
    """Serve one virtual robot until nobody needs it any more."""
    settings = typed(Settings, cfg)
    parent = os.getppid() if settings.parent is None else settings.parent
    identity = identity_of(cfg)
    plant = held_plant(cfg, identity.clock) if settings.held else plant_of(cfg)
    if settings.firmware is not None and settings.protocol != VERSION:
        raise ConfigError(f"The firmware speaks version {VERSION} of the protocol; found protocol={settings.protocol}.")
    with uncollected() if identity.clock is Clock.REAL_TIME else nullcontext():
        if settings.firmware is None:
            serve(plant, identity, settings.idle_timeout, parent)
            return
        with ended_by_signals():
            serve_firmware(Path(settings.firmware), plant, identity, settings.idle_timeout, parent)


def held_plant(cfg: DictConfig, clock: Clock) -> HeldRobot:
    """What moves in a hand; its keys are printed.

    Raises:
        ConfigError: its time is not that of the hand.
    """
    if clock is not Clock.REAL_TIME:
        raise ConfigError("A hand needs time: set clock=real_time beside held=true.")
    for key, what in KEYS.items():
        say(f"{key} and Enter: {what}")
    say("Ctrl-C: pull the plug")
    return HeldRobot(instantiate(cfg.robot), Keys(sys.stdin).pressed)


def identity_of(cfg: DictConfig) -> Identity:
    """What the robot says of itself."""
    settings = typed(Settings, cfg)
    robot: RobotParameters = instantiate(cfg.robot)
    return Identity(
        name=robot.name,
        torque_limit=robot.torque_limit,
        tilt_limit=settings.self_stop_tilt,
        watchdog=settings.watchdog,
        clock=Clock[settings.clock.upper()],
        version=settings.protocol,
    )


def plant_of(cfg: DictConfig) -> MujocoRobot:
    """What moves, with all that it hides."""
    settings = typed(Settings, cfg)
    robot: RobotParameters = instantiate(cfg.robot)
    return MujocoRobot(
        truth=draw_ground_truth(instantiate(cfg.faults), robot, settings.seed),
        control_period=robot.control_period,
        start=instantiate(cfg.start),
        physics_step=settings.physics_step,
        seed=child_seed(Stream.VIRTUAL_ROBOT, settings.seed),  # no numbers in common with the host's simulation
    )
