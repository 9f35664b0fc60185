"""What an effect is, and the places where one can act.

A new effect is a file beside this one, with a frozen dataclass of one of the kinds below. A new kind (the ground, an
outside force) is an abstract class here, a field of `Machine` that `assemble` fills, and its use in the engines.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from enum import IntEnum
from typing import ClassVar

import numpy as np

from twbal.engine.machine import Drive, Machine, SensorFilter, TorqueFilter
from twbal.errors import ConfigError
from twbal.robot.parameters import RobotParameters


class Place(IntEnum):
    """Where along the way from the command to the measurement an effect acts; effects act in this order."""

    BODY = 0
    COMMAND = 1
    DRIVER = 2
    GEAR = 3
    MOTOR = 4
    JOINT = 5
    SENSOR = 6
    NOISE = 7


class Effect(ABC):
    """Something true of a robot that its data sheet leaves out.

    An effect is a frozen dataclass of its parameters, and a subclass of one of the kinds below. What must be remembered
    within a rollout lives in the object that `start` hands out, never in the effect.
    """

    place: ClassVar[Place]

    def _require(self, name: str, low: float, high: float = float("inf")) -> None:
        """Raise ConfigError unless the field `name` lies within [low, high) and is finite."""
        value = getattr(self, name)
        if not low <= value < high:
            raise ConfigError(f"{name} of effect {type(self).__name__} must lie within [{low}, {high}); found {value}.")


class BodyEffect(Effect):
    """Changes masses and lengths."""

    place = Place.BODY

    @abstractmethod
    def alter(self, robot: RobotParameters) -> RobotParameters:
        """The robot as it really is."""


class DriveEffect(Effect):
    """Changes what happens in the wheels' joints."""

    place = Place.JOINT

    @abstractmethod
    def alter(self, drive: Drive) -> Drive:
        """The drive as it really is."""


class ActuatorEffect(Effect):
    """Stands between the command and the motors."""

    @abstractmethod
    def start(self, physics_step: float, rng: np.random.Generator) -> TorqueFilter:
        """A fresh link for one rollout: summed torque in, summed torque out [N·m], once a physics step [s]."""


class SensorEffect(Effect):
    """Stands between the truth and what is measured."""

    place = Place.SENSOR

    @abstractmethod
    def start(self, control_period: float, rng: np.random.Generator) -> SensorFilter:
        """A fresh sensor for one rollout, called once a control period [s]."""


def assemble(robot: RobotParameters, effects: Sequence[Effect]) -> Machine:
    """The robot with its effects, each at its place, whatever the order in which they are listed.

    Commands are cut at the data sheet's torque limit.
    """
    ordered = sorted(effects, key=lambda effect: (effect.place, type(effect).__name__))
    drive = Drive()
    torque_limit = robot.torque_limit
    for effect in ordered:
        if isinstance(effect, BodyEffect):
            robot = effect.alter(robot)
        elif isinstance(effect, DriveEffect):
            drive = effect.alter(drive)
    return Machine(
        robot=robot,
        torque_limit=torque_limit,
        drive=drive,
        actuators=tuple(e for e in ordered if isinstance(e, ActuatorEffect)),
        sensors=tuple(e for e in ordered if isinstance(e, SensorEffect)),
    )
