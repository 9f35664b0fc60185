"""What an effect is, and the places where one can act.

An effect is one file with a frozen dataclass: its parameters, with all that is known of them (`parameter`), what it
does to a robot, and what there is to say of it. It can act in three ways, and in several of them at once:

- A parameter changes quantities of the robot (`Quantity`): masses, lengths, friction, delays. Nothing else is written.
- A term: a method of a few lines of arithmetic that both engines run in each physics step or at each measurement. They
  are the abstract methods of `TorqueTerm`, `JointTerm`, `AxleTerm` and `SensorTerm`. PyBullet calls them as they are;
  for the planar model they are compiled, with `self` a named tuple of the effect's parameters. So they use numbers,
  `math`, and the named tuple that they are given, and remember nothing.
- Code for PyBullet alone, where an effect remembers something or is more than arithmetic: the abstract methods of
  `Actuator`, `Joint` and `Sensor` in `core/robot_model.py`. What it is to the planar model must be said as well, by one
  of the two other ways; without that it is simulated by PyBullet but cannot be diagnosed.
"""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, replace
from enum import IntEnum
from typing import Any, ClassVar, TypeVar

import numpy as np

from twbal.core.errors import ConfigError
from twbal.core.plant import Observation
from twbal.core.quantities import changed
from twbal.core.robot_model import (
    Actuator,
    AxleMotion,
    DriveTrain,
    Frame,
    Ground,
    JointMotion,
    JointTorque,
    Reading,
    RobotModel,
    Sensor,
    SensorFilter,
    TorqueFilter,
)
from twbal.core.robot_parameters import RobotParameters
from twbal.effects.parameter import parameters_of

Part = TypeVar("Part", RobotParameters, Frame, DriveTrain, Ground)


class Place(IntEnum):
    """Where along the way from the command to the measurement an effect acts; effects act in this order."""

    BODY = 0
    LINK = 1
    COMMAND = 2
    DRIVER = 3
    GEAR = 4
    RAMP = 5
    MOTOR = 6
    JOINT = 7
    GROUND = 8
    OUTSIDE = 9
    FUSION = 10
    LATENCY = 11
    SENSOR = 12
    OFFSET = 13
    NOISE = 14


class Effect(ABC):
    """Something true of a robot that its data sheet leaves out.

    An effect is a frozen dataclass of its parameters. What must be remembered within a rollout lives in the object that
    `start` hands out, never in the effect.

    Attributes:
        place: where it acts.
        reference: a paper or book that describes it.
        is_linear: whether a linear model about the balance has it: that is what the gain of the diagnosis' Kalman
            filter follows from. So it is not for dead zones, dry friction, constants and forces that depend on time,
            nor for what acts between the command and the motors.
        same_as: names of effects that do exactly the same to everything the robot measures.
        nearly_same_as: names of effects that the robot's sensors and commands hardly tell from it.
        never_beside: names of effects that no robot has beside it.
        acts_on: names of effects that it changes: it does nothing where there is none of them; empty: it acts alone.
        separate_by: the experiment that would.
        is_last: whether, in the planar model, it acts after the others of its place. (The last digits of a product
            depend on its order.)
        diagnosed_separately: whether a diagnosis asks for it apart from all other effects, so that the planar model
            passes it over.
        weighed_if_asked: whether a diagnosis weighs it only where its settings ask for it, as others look like it.
        tried_at: values of parameters at which a diagnosis tries it, all with all, where one start is not enough: how
            likely it makes recordings has many local optima.
    """

    place: ClassVar[Place]
    reference: ClassVar[str]
    is_linear: ClassVar[bool]
    same_as: ClassVar[tuple[str, ...]] = ()
    nearly_same_as: ClassVar[tuple[str, ...]] = ()
    never_beside: ClassVar[tuple[str, ...]] = ()
    acts_on: ClassVar[tuple[str, ...]] = ()
    separate_by: ClassVar[str]
    is_last: ClassVar[bool] = False
    diagnosed_separately: ClassVar[bool] = False
    weighed_if_asked: ClassVar[bool] = False
    tried_at: ClassVar[Mapping[str, tuple[float, ...]]] = {}

    def __post_init__(self) -> None:
        """Raise ConfigError where a parameter has a value that cannot be."""
        for name, known in parameters_of(type(self)).items():
            value = getattr(self, name)
            try:
                is_within = known.least <= value < known.below or value == known.neutral
            except TypeError as error:
                raise ConfigError(
                    f"{name} of effect {type(self).__name__} must be a number; found {value!r:.80}."
                ) from error
            if not is_within:
                raise ConfigError(
                    f"{name} of effect {type(self).__name__} must lie within [{known.least:g}, {known.below:g}); "
                    f"found {value}."
                )

    def alter(self, part: Part) -> Part:
        """Body, frame, drive or ground for PyBullet, with the quantities changed that its parameters change."""
        has = {field.name for field in fields(part)}
        values: dict[str, Any] = {}
        for name, parameter in parameters_of(type(self)).items():
            for quantity, change in parameter.changes:
                key = quantity.name.lower()
                if key in has:
                    values[key] = changed(values.get(key, getattr(part, key)), change, getattr(self, name))
        return replace(part, **values) if values else part


class TorqueTerm(ABC):
    """What becomes of the command on its way to the motors."""

    @abstractmethod
    def drive(self, torque: float, time: float) -> float:
        """Summed torque [N·m], by the one that comes in and the time since the rollout began [s]."""


class JointTerm(ABC):
    """A torque in the wheels' joints."""

    @abstractmethod
    def turn(self, torque: float, at: JointMotion) -> float:
        """Summed torque in the joints [N·m], by the one so far."""


class AxleTerm(ABC):
    """A force from outside at the axle."""

    @abstractmethod
    def push(self, force: float, at: AxleMotion) -> float:
        """The force, forward [N], by the one so far."""


class SensorTerm(ABC):
    """What a sensor makes of the truth."""

    @abstractmethod
    def sense(self, seen: Reading, time: float) -> Reading:
        """What is shown of what comes in, by the time since the rollout began [s]."""

    @abstractmethod
    def correct(self, seen: Reading, time: float) -> Reading:
        """What came in, by what is shown."""


class BodyEffect(Effect):
    """Changes masses and lengths."""

    place = Place.BODY
    is_linear = True


class DriveEffect(Effect):
    """Changes what happens in the wheels' joints."""

    place = Place.JOINT


class GroundEffect(Effect):
    """Changes the ground."""

    place = Place.GROUND


class ActuatorEffect(Effect):
    """Stands between the command and the motors, and remembers.

    Attributes:
        remembers: whether what it gives depends on more than the command of the moment.
    """

    remembers: ClassVar[bool] = True
    is_linear = False

    @abstractmethod
    def start(self, physics_step: float, rng: np.random.Generator) -> TorqueFilter:
        """A fresh link for one rollout: summed torque in, summed torque out [N·m], once a physics step [s]."""

    def on(self, robot: RobotParameters) -> Actuator:
        """What it is on a robot: itself, unless it has to know its control period."""
        return self


class DriverEffect(ActuatorEffect, TorqueTerm):
    """Stands between the command and the motors, and remembers nothing: neither the past nor the time.

    PyBullet gives its `drive` the time 0. One that depends on time derives from `ActuatorEffect` and `TorqueTerm`, and
    counts the physics steps in `start`, as `BatterySag` does.
    """

    place = Place.DRIVER
    remembers = False

    def start(self, physics_step: float, rng: np.random.Generator) -> TorqueFilter:
        """Hand out its term."""
        return lambda torque: self.drive(torque, 0.0)


class JointEffect(Effect):
    """A torque in the wheels' joints that depends on their motion."""

    place = Place.JOINT

    @abstractmethod
    def start(self, robot: RobotParameters, physics_step: float) -> JointTorque:
        """A fresh joint of a robot (with all effects on its body) for one rollout."""


class JointTorqueEffect(JointEffect, JointTerm):
    """A torque in the wheels' joints that depends on their motion of the moment."""

    def start(self, robot: RobotParameters, physics_step: float) -> JointTorque:
        """Hand out its term."""
        return self.turn


class OutsideEffect(Effect, AxleTerm):
    """A force from outside at the axle."""

    place = Place.OUTSIDE


class SensorEffect(Effect):
    """Stands between the truth and what is measured, and remembers or draws at random."""

    place = Place.SENSOR

    @abstractmethod
    def start(self, control_period: float, rng: np.random.Generator) -> SensorFilter:
        """A fresh sensor for one rollout, called once a control period [s]."""

    def on(self, robot: RobotParameters, effects: Sequence[Effect]) -> Sensor:
        """This sensor on a robot that has all these effects: itself, unless it reads what another one makes."""
        return self


class ReadingEffect(SensorEffect, SensorTerm):
    """Stands between the truth and what is measured, and remembers nothing."""

    def start(self, control_period: float, rng: np.random.Generator) -> SensorFilter:
        """Hand out its term."""

        def shown(truth: Observation) -> Observation:
            seen = Reading(truth.tilt, truth.tilt_rate, truth.wheel_angle, truth.wheel_rate)
            return truth._replace(**self.sense(seen, truth.time)._asdict())

        return shown


def assemble(robot: RobotParameters, effects: Sequence[Effect]) -> RobotModel:
    """The robot with its effects, each at its place, whatever the order in which they are listed.

    Commands are cut at the data sheet's torque limit.

    Raises:
        ConfigError: an effect is there twice, or the robot has play on both sides of its encoders.
    """
    refuse_twice(effects)
    ordered = _in_their_order(effects)
    frame, drive, ground = Frame(), DriveTrain(), Ground()
    torque_limit = robot.torque_limit
    for effect in ordered:
        robot, frame = effect.alter(robot), effect.alter(frame)
        drive, ground = effect.alter(drive), effect.alter(ground)
    if drive.gap > 0.0 and drive.shaft_gap > 0.0:
        raise ConfigError(
            "A robot's encoders sit on its wheels or on its motors' shafts: leave one of the effects backlash and "
            "backlash_behind_encoder out."
        )
    return RobotModel(
        robot=robot,
        torque_limit=torque_limit,
        frame=frame,
        drive=drive,
        ground=ground,
        joints=tuple(e for e in ordered if isinstance(e, JointEffect)),
        pushes=tuple(e.push for e in ordered if isinstance(e, AxleTerm)),
        actuators=tuple(e.on(robot) for e in ordered if isinstance(e, ActuatorEffect)),
        sensors=tuple(e.on(robot, ordered) for e in ordered if isinstance(e, SensorEffect)),
    )


def refuse_twice(effects: Iterable[Effect]) -> None:
    """Refuse two effects of one kind: the planar model has one of each, and no diagnosis could tell them apart.

    Raises:
        ConfigError: there are two.
    """
    for kind, count in Counter(map(type, effects)).items():
        if count > 1:
            raise ConfigError(f"The robot has the effect {kind.__name__} twice; give one with what both do together.")


def torque_left(robot: RobotParameters, effects: Sequence[Effect]) -> float:
    """Torque that turns the wheels at the largest command, forward or backward, whichever is less [N·m].

    It is what drivers and motors make of the data sheet's torque limit, less the dry friction of both wheels at rest.
    Where it is 0 or less, no command turns wheels that stand.

    Args:
        robot: data sheet.
        effects: of the robot.

    Raises:
        ConfigError: as of `assemble`.
    """
    model = assemble(robot, effects)
    forward, backward = robot.torque_limit, -robot.torque_limit
    for effect in _in_their_order(effects):
        if isinstance(effect, TorqueTerm):
            forward, backward = effect.drive(forward, 0.0), effect.drive(backward, 0.0)
    return min(forward, -backward) - 2.0 * model.drive.dry_friction(0.0)


def _in_their_order(effects: Iterable[Effect]) -> list[Effect]:
    return sorted(effects, key=lambda effect: (effect.place, type(effect).__name__))
