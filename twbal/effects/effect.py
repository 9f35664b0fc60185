"""What an effect is, and the places where one can act.

A new effect is a file beside this one, with a frozen dataclass of one of the kinds below. A new kind (the ground, an
outside force) is an abstract class here, a field of `Machine` that `assemble` fills, and its use in the engines.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import field, fields
from enum import IntEnum
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np

from twbal.core.errors import ConfigError
from twbal.core.robot_model import Drive, Ground, JointTorque, Machine, Push, SensorFilter, TorqueFilter
from twbal.core.robot_parameters import RobotParameters


class Place(IntEnum):
    """Where along the way from the command to the measurement an effect acts; effects act in this order."""

    BODY = 0
    COMMAND = 1
    DRIVER = 2
    GEAR = 3
    MOTOR = 4
    JOINT = 5
    GROUND = 6
    OUTSIDE = 7
    LATENCY = 8
    SENSOR = 9
    OFFSET = 10
    NOISE = 11


class Parameter(NamedTuple):
    """What is known of a parameter before any data.

    Attributes:
        unit: "" for a plain number.
        low: lowest value that a plausible robot has.
        high: highest.
        start: a value at which data say something about it: at the value that does nothing many slopes are zero.
        none: value at which the effect does nothing.
        scale: what `low`, `high` and `start` grow with: the robot's torque limit over 20 N·m ("torque"), its control
            period over 20 ms ("period"), or nothing ("").
    """

    unit: str
    low: float
    high: float
    start: float
    none: float
    scale: Literal["", "torque", "period"]


def parameter(
    unit: str, low: float, high: float, start: float, none: float = 0.0, scale: Literal["", "torque", "period"] = ""
) -> Any:  # Any: what dataclasses.field returns stands for a value of the field's own type
    """A field of an effect with what is known of it; arguments as of `Parameter`."""
    return field(metadata={"parameter": Parameter(unit, low, high, start, none, scale)})


class Effect(ABC):
    """Something true of a robot that its data sheet leaves out.

    An effect is a frozen dataclass of its parameters, and a subclass of one of the kinds below. What must be remembered
    within a rollout lives in the object that `start` hands out, never in the effect.

    Attributes:
        place: where it acts.
        same_as: names of effects that do exactly the same to everything the robot measures.
        cannot_be_told_from: names of effects that the robot's sensors and commands hardly tell from it.
        separate_by: the experiment that would.
    """

    place: ClassVar[Place]
    same_as: ClassVar[tuple[str, ...]] = ()
    cannot_be_told_from: ClassVar[tuple[str, ...]] = ()
    separate_by: ClassVar[str] = ""

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
    """Stands between the command and the motors.

    Attributes:
        remembers: whether what it gives depends on more than the command of the moment.
    """

    remembers: ClassVar[bool] = True

    @abstractmethod
    def start(self, physics_step: float, rng: np.random.Generator) -> TorqueFilter:
        """A fresh link for one rollout: summed torque in, summed torque out [N·m], once a physics step [s]."""


class JointEffect(Effect):
    """A torque in the wheels' joints that depends on their motion."""

    place = Place.JOINT

    @abstractmethod
    def start(self, robot: RobotParameters, physics_step: float) -> JointTorque:
        """A fresh joint of a robot (with all effects on its body) for one rollout."""


class GroundEffect(Effect):
    """Changes the ground."""

    place = Place.GROUND

    @abstractmethod
    def alter(self, ground: Ground) -> Ground:
        """The ground as it really is."""


class OutsideEffect(Effect):
    """A force from outside at the axle."""

    place = Place.OUTSIDE

    @abstractmethod
    def push(self, robot: RobotParameters) -> Push:
        """The force [N] on a robot by the axle's way since the rollout began [m] and the time since then [s]."""


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
    drive, ground = Drive(), Ground()
    torque_limit = robot.torque_limit
    for effect in ordered:
        if isinstance(effect, BodyEffect):
            robot = effect.alter(robot)
        elif isinstance(effect, DriveEffect):
            drive = effect.alter(drive)
        elif isinstance(effect, GroundEffect):
            ground = effect.alter(ground)
    return Machine(
        robot=robot,
        torque_limit=torque_limit,
        drive=drive,
        ground=ground,
        joints=tuple(e for e in ordered if isinstance(e, JointEffect)),
        pushes=tuple(e.push(robot) for e in ordered if isinstance(e, OutsideEffect)),
        actuators=tuple(e for e in ordered if isinstance(e, ActuatorEffect)),
        sensors=tuple(e for e in ordered if isinstance(e, SensorEffect)),
    )


def parameters_of(effect: type[Effect]) -> dict[str, Parameter]:
    """What is known of each parameter of an effect, by name."""
    return {f.name: f.metadata["parameter"] for f in fields(effect) if "parameter" in f.metadata}  # type: ignore[arg-type]
