"""Rotors that turn with the gears and not with the wheels in space."""

from dataclasses import dataclass

from twbal.core.quantities import Quantity
from twbal.effects.effect import DriveEffect
from twbal.effects.parameter import adds_to, parameter, reduces


@dataclass(frozen=True)
class RotorInertia(DriveEffect):
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
    nearly_same_as = ("body_inertia", "com_height", "torque_gain", "wheel_radius")
    separate_by = "Turn a wheel by hand with the motors off, the body held."
