"""A robot as it really is: the data sheet, changed by whatever effects act on it, for any engine to simulate.

The plain values of it serve kernels, too (`twbal.core.compiled`).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import exp, isfinite
from typing import ClassVar, NamedTuple, Protocol

import numpy as np

from twbal.core.errors import ConfigError, DataError
from twbal.core.plant import Observation
from twbal.core.robot_parameters import RobotParameters

TorqueFilter = Callable[[float], float]
"""One link of the chain from the command to the motors: summed torque in, summed torque out, once a physics step."""

UNBOUNDED = 1e9
"""Stands for no limit, where a quantity is one [N·m], and for tyres that cannot slip."""

SensorFilter = Callable[[Observation], Observation]
"""What a sensor makes of the truth, once a control period."""


class Actuator(Protocol):
    """Something between the command and the motors.

    Attributes:
        remembers: whether what it gives depends on more than the command of the moment.
    """

    remembers: ClassVar[bool]

    def start(self, physics_step: float, rng: np.random.Generator) -> TorqueFilter:
        """A fresh link for one rollout, called once a physics step of `physics_step` [s]."""


class Sensor(Protocol):
    """Something between the truth and what is measured."""

    def start(self, control_period: float, rng: np.random.Generator) -> SensorFilter:
        """A fresh sensor for one rollout, called once a control period [s]."""


class JointMotion(NamedTuple):
    """What the wheels' joints do, as the mean of both.

    One wheel is ahead of the mean by apart·heading and the other is behind it by as much.

    Attributes:
        angle: of the wheel relative to the body [rad].
        rate: [rad/s].
        apart: angle for each radian of heading; where `heading` is 1, all of it [rad].
        heading: by which the robot has turned [rad]; 1 where only the product is known.
        apart_rate: by which one wheel turns faster than the mean and the other slower [rad/s].
    """

    angle: float
    rate: float
    apart: float = 0.0
    heading: float = 1.0
    apart_rate: float = 0.0


JointTorque = Callable[[float, JointMotion], float]
"""What arrives at the joints of the motors' summed torque [N·m], by the joints' motion; once a physics step."""


class AxleMotion(NamedTuple):
    """How the axle moves, and the wheels in space as the mean of both.

    One wheel is ahead of the mean by apart·heading and the other is behind it by as much, as in `JointMotion`.

    Attributes:
        position: along its way since the rollout began [m].
        speed: forward [m/s].
        time: since the rollout began [s].
        weight: of the whole robot [N].
        angle: of the wheels in space: what the encoders count, and the tilt [rad].
        rate: of that [rad/s].
        apart: angle for each radian of heading; where `heading` is 1, all of it [rad].
        heading: by which the robot has turned [rad]; 1 where only the product is known.
        x, y: place of the axle, ahead of where the rollout began and to the left of that [m].
        cosine, sine: of the angle by which the robot has turned to the left since then.
    """

    position: float
    speed: float
    time: float
    weight: float
    angle: float = 0.0
    rate: float = 0.0
    apart: float = 0.0
    heading: float = 1.0
    x: float = 0.0
    y: float = 0.0
    cosine: float = 1.0
    sine: float = 0.0


Push = Callable[[float, AxleMotion], float]
"""The force at the axle, forward, with all that pushed before [N]; by the axle's motion, once a physics step."""


class Reading(NamedTuple):
    """What IMU and encoders show at an instant.

    Attributes:
        tilt: [rad].
        tilt_rate: [rad/s].
        wheel_angle: relative to the body [rad].
        wheel_rate: [rad/s].
    """

    tilt: float
    tilt_rate: float
    wheel_angle: float
    wheel_rate: float


class Joint(Protocol):
    """Something in the wheels' joints that depends on how they move."""

    def start(self, robot: RobotParameters, physics_step: float) -> JointTorque:
        """A fresh joint of a robot for one rollout, called once a physics step of `physics_step` [s]."""


@dataclass(frozen=True)
class Frame:
    """The body's frame, which may yield: a part of the body then swings fore and aft on a spring.

    Attributes:
        swinging_share: of the body's mass; 0: the frame is rigid.
        swing_frequency: at which that part would swing if the rest of the body stood still [Hz].
        swing_damping: damping ratio of that.
        swing_height: of the part above the axle, over that of the body's centre of mass.
    """

    swinging_share: float = 0.0
    swing_frequency: float = 5.0
    swing_damping: float = 0.05
    swing_height: float = 1.8


@dataclass(frozen=True)
class DriveTrain:
    """What lies between motors and wheels, friction of each wheel's joint above all.

    Attributes:
        coulomb_friction: torque that opposes turning, or holds the wheel to the body [N·m].
        viscous_friction: torque over the wheel's rate relative to the body [N·m·s/rad].
        breakaway: by which the dry friction is greater at rest [N·m]; it fades as exp(-(rate / stribeck_rate)²).
        stribeck_rate: [rad/s].
        gap: play between rotor and wheel, full width [rad]; the rotors then turn by themselves.
        rotor_share: share of the wheels' inertia that lies on the motors' side of that play.
        contact_time: for which an impact of the rotors on wheels that stand still lasts without damping [s]; 0: they
            meet as rigid bodies, and do not bounce.
        contact_damping: of that, over critical damping.
        shaft_gap, shaft_rotor_share, shaft_contact_time, shaft_contact_damping: the same, where the encoders sit on the
            motors' side of the play.
        imbalance: share by which the right motor is stronger than the mean of both.
        presliding: angle of a wheel over which its dry friction grows after its rate changed sign, that of the ground,
            too [rad]; 0: none.
        geared_share: of each wheel's inertia on the data sheet, the part that turns relative to the body. The robot's
            `wheel_inertia` is without it.

    Raises:
        ConfigError: geared rotors have all of a wheel's inertia.
    """

    coulomb_friction: float = 0.0
    viscous_friction: float = 0.0
    breakaway: float = 0.0
    stribeck_rate: float = 1.0
    gap: float = 0.0
    rotor_share: float = 0.5
    contact_time: float = 0.0
    contact_damping: float = 0.4
    shaft_gap: float = 0.0
    shaft_rotor_share: float = 0.5
    shaft_contact_time: float = 0.0
    shaft_contact_damping: float = 0.4
    imbalance: float = 0.0
    presliding: float = 0.0
    geared_share: float = 0.0

    def __post_init__(self) -> None:
        if not self.geared_share < 1.0:
            raise ConfigError(
                f"Geared rotors have {self.geared_share:g} of a wheel's inertia; expected less than all of it. Leave "
                "one of the effects out that add to their share."
            )

    def dry_friction(self, rate: float) -> float:
        """Largest dry friction of each joint [N·m] at a rate relative to the body [rad/s]."""
        if not self.breakaway:
            return self.coulomb_friction
        return self.coulomb_friction + self.breakaway * exp(-((rate / self.stribeck_rate) ** 2))


@dataclass(frozen=True)
class Ground:
    """What the wheels stand on.

    Attributes:
        slope: angle by which it rises towards +x [rad].
        grip: coefficient of dry friction between tyre and ground; PyBullet takes 1 for all that is more.
        tyre_creep: speed of slip at which tyres slide that creep before [m/s]; 0: they stick until they slide.
        rolling_resistance: dry torque of each wheel that opposes its turning over ground [N·m].
        rolling_viscous: torque of each wheel over its rate over ground [N·m·s/rad].
    """

    slope: float = 0.0
    grip: float = UNBOUNDED
    tyre_creep: float = 0.0
    rolling_resistance: float = 0.0
    rolling_viscous: float = 0.0


@dataclass(frozen=True)
class RobotModel:
    """A robot with its effects applied.

    Attributes:
        robot: with the effects on the body in it.
        torque_limit: at which a command is cut, before anything else happens to it [N·m].
        frame: of the body, and what of it swings.
        drive: friction of the joints.
        ground: what the wheels stand on.
        joints: what else happens in the joints, in that order.
        pushes: forces at the axle, in that order.
        actuators: from the command to the motors, in that order.
        sensors: from the truth to what is measured, in that order.
    """

    robot: RobotParameters
    torque_limit: float
    frame: Frame = Frame()
    drive: DriveTrain = DriveTrain()
    ground: Ground = Ground()
    joints: tuple[Joint, ...] = ()
    pushes: tuple[Push, ...] = ()
    actuators: tuple[Actuator, ...] = ()
    sensors: tuple[Sensor, ...] = ()

    @property
    def with_rotors(self) -> RobotParameters:
        """The robot with the inertia of geared rotors in that of its wheels, as its data sheet has it."""
        share = self.drive.geared_share
        return replace(self.robot, wheel_inertia=self.robot.wheel_inertia / (1.0 - share)) if share else self.robot

    def clip(self, command: float) -> float:
        """The command, cut to the torque limit [N·m].

        Raises:
            DataError: it is not finite.
        """
        return clipped(command, self.torque_limit)

    def start(self, physics_step: float, rng: np.random.Generator) -> "EffectState":
        """Fresh memory for one rollout; each effect draws from a stream of its own."""
        streams = rng.spawn(len(self.actuators) + len(self.sensors))
        actuators = [a.start(physics_step, stream) for a, stream in zip(self.actuators, streams, strict=False)]
        sensing = streams[len(self.actuators) :]
        period = self.robot.control_period
        sensors = [s.start(period, stream) for s, stream in zip(self.sensors, sensing, strict=True)]
        joints = tuple(joint.start(self.robot, physics_step) for joint in self.joints)
        return EffectState(tuple(actuators), tuple(sensors), joints)


def clipped(command: float, torque_limit: float) -> float:
    """A command, cut to a torque limit [N·m].

    Raises:
        DataError: it is not finite. A simulation that got such a command would be none any more.
    """
    if not isfinite(command):
        raise DataError(f"A command must be a finite torque; found {command} N·m.")
    return min(max(float(command), -torque_limit), torque_limit)


@dataclass(frozen=True)
class EffectState:
    """What actuators, joints and sensors remember within one rollout."""

    actuators: tuple[TorqueFilter, ...]
    sensors: tuple[SensorFilter, ...]
    joints: tuple[JointTorque, ...] = ()

    def turn(self, torque: float, motion: JointMotion) -> float:
        """Summed torque in the joints [N·m] of what the motors give, by how the joints move."""
        for joint in self.joints:
            torque = joint(torque, motion)
        return torque

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
