"""Rotors that turn with the gears and not with the wheels in space."""

from dataclasses import dataclass, replace

from twbal.core.mobility import joint_mobility
from twbal.core.robot_model import JointMotion, JointTorque
from twbal.core.robot_parameters import RobotParameters
from twbal.effects.effect import BodyEffect, JointEffect, Place, parameter


@dataclass(frozen=True)
class RotorInertia(BodyEffect, JointEffect):
    """Part of the wheels' inertia is that of rotors, which a high gear turns relative to the body.

    A data sheet lumps N² times the rotor's inertia with the wheel, J in all. The wheel's link has it no more; in its
    place the joint feels -J times the acceleration of the wheel relative to the body. It acts between wheel and body.

    Attributes:
        share: of the wheel's inertia.
    """

    share: float = parameter("", 0.0, 0.98, 0.5)
    cannot_be_told_from = ("body_inertia", "com_height")
    separate_by = "Turn a wheel by hand with the motors off, the body held."
    place = Place.JOINT

    def __post_init__(self) -> None:
        self._require("share", 0, 0.99)

    def alter(self, robot: RobotParameters) -> RobotParameters:
        """The robot whose wheels are without their rotors."""
        return replace(robot, wheel_inertia=(1 - self.share) * robot.wheel_inertia)

    def start(self, robot: RobotParameters, physics_step: float) -> JointTorque:
        """Hand out the joint of a robot whose wheels are without their rotors.

        What the acceleration of the coming step will be, follows from that of the last one and from how much the torque
        changes in between.
        """
        inertia = 2 * self.share / (1 - self.share) * robot.wheel_inertia
        gain = inertia * joint_mobility(robot)
        given = taken = 0.0

        def joint(torque: float, motion: JointMotion) -> float:
            nonlocal given, taken
            taken = (gain * taken - inertia * motion.acceleration - gain * (torque - given)) / (1 + gain)
            given = torque
            return torque + taken

        return joint
