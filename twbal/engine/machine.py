"""A robot as it really is: the data sheet, changed by whatever effects act on it, for any engine to simulate."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from twbal.plant import Observation
from twbal.robot.parameters import RobotParameters

TorqueFilter = Callable[[float], float]
"""One link of the chain from the command to the motors: summed torque in, summed torque out, once a physics step."""

SensorFilter = Callable[[Observation], Observation]
"""What a sensor makes of the truth, once a control period."""


class Actuator(Protocol):
    """Something between the command and the motors."""

    def start(self, physics_step: float, rng: np.random.Generator) -> TorqueFilter:
        """A fresh link for one rollout, called once a physics step of `physics_step` [s]."""


class Sensor(Protocol):
    """Something between the truth and what is measured."""

    def start(self, control_period: float, rng: np.random.Generator) -> SensorFilter:
        """A fresh sensor for one rollout, called once a control period [s]."""


@dataclass(frozen=True)
class Drive:
    """Friction of each wheel's joint, which acts between wheel and body.

    Attributes:
        coulomb_friction: torque that opposes turning, or holds the wheel to the body [N·m].
        viscous_friction: torque over the wheel's rate relative to the body [N·m·s/rad].
    """

    coulomb_friction: float = 0.0
    viscous_friction: float = 0.0


@dataclass(frozen=True)
class Machine:
    """A robot with its effects applied.

    Attributes:
        robot: with the effects on the body in it.
        torque_limit: at which a command is cut, before anything else happens to it [N·m].
        drive: friction of the joints.
        actuators: from the command to the motors, in that order.
        sensors: from the truth to what is measured, in that order.
    """

    robot: RobotParameters
    torque_limit: float
    drive: Drive = Drive()
    actuators: tuple[Actuator, ...] = ()
    sensors: tuple[Sensor, ...] = ()

    def clip(self, command: float) -> float:
        """The command, cut to the torque limit [N·m]."""
        return min(max(float(command), -self.torque_limit), self.torque_limit)

    def start(self, physics_step: float, rng: np.random.Generator) -> "Running":
        """Fresh memory for one rollout; each effect draws from a stream of its own."""
        streams = rng.spawn(len(self.actuators) + len(self.sensors))
        actuators = [a.start(physics_step, stream) for a, stream in zip(self.actuators, streams, strict=False)]
        sensing = streams[len(self.actuators) :]
        period = self.robot.control_period
        sensors = [s.start(period, stream) for s, stream in zip(self.sensors, sensing, strict=True)]
        return Running(tuple(actuators), tuple(sensors))


@dataclass(frozen=True)
class Running:
    """What actuators and sensors remember within one rollout."""

    actuators: tuple[TorqueFilter, ...]
    sensors: tuple[SensorFilter, ...]

    def actuate(self, command: float) -> float:
        """Summed torque that reaches the joints in the next physics step [N·m]."""
        for actuator in self.actuators:
            command = actuator(command)
        return command

    def sense(self, truth: Observation) -> Observation:
        """What is measured of the truth."""
        for sensor in self.sensors:
            truth = sensor(truth)
        return truth
