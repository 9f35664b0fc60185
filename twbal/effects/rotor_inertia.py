"""Rotors that turn with the gears and not with the wheels in space."""

from dataclasses import dataclass

from twbal.core.mobility import joint_mobility
from twbal.core.quantities import Quantity
from twbal.core.robot_model import JointMotion, JointTorque
from twbal.core.robot_parameters import RobotParameters
from twbal.effects.effect import JointEffect
from twbal.effects.parameter import adds_to, parameter, reduces


@dataclass(frozen=True)
class RotorInertia(JointEffect):
    """Part of the wheels' inertia is that of rotors, which a high gear turns relative to the body.

    A data sheet lumps N² times the rotor's inertia with the wheel, J in all. The wheel's link has it no more; in its
    place the joint feels -J times the acceleration of the wheel relative to the body. It acts between wheel and body.
    """

    share: float = parameter(
        "of the wheel's inertia that is the rotor's",
        "",
        (0.0, 0.98),
        start=0.5,
        value=0.8,
        below=0.99,
        changes=(*adds_to(Quantity.GEARED_SHARE), *reduces(Quantity.WHEEL_INERTIA)),
    )
    reference = (
        "B. Siciliano, L. Sciavicco, L. Villani, G. Oriolo: Robotics - Modelling, Planning and Control, Springer, 2009."
    )
    is_linear = True
    nearly_same_as = ("body_inertia", "com_height")
    separate_by = "Turn a wheel by hand with the motors off, the body held."

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
