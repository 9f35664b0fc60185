"""Dry friction that is greater at rest."""

from dataclasses import dataclass

from twbal.core.quantities import Quantity
from twbal.effects.effect import DriveEffect
from twbal.effects.parameter import Scale, adds_to, parameter, replaces


@dataclass(frozen=True)
class StribeckFriction(DriveEffect):
    """Each joint resists turning with `torque`, and with `breakaway` more at rest.

    The bound of the friction is torque + breakaway·exp(-(ω / rate)²), ω being the wheel's rate relative to the body. It
    acts between wheel and body. It looks most like Coulomb friction where the robot seldom stands.
    """

    torque: float = parameter(
        "dry friction of each wheel while it turns fast",
        "N·m",
        (0.0, 2.0),
        start=0.1,
        value=0.2,
        scale=Scale.TORQUE,
        changes=adds_to(Quantity.COULOMB_FRICTION),
        is_of_each_wheel=True,
    )
    breakaway: float = parameter(
        "by which the friction is greater at rest",
        "N·m",
        (0.0, 2.0),
        start=0.2,
        value=0.3,
        scale=Scale.TORQUE,
        changes=adds_to(Quantity.BREAKAWAY),
        is_of_each_wheel=True,
    )
    rate: float = parameter(
        "of the wheel, over which that fades",
        "rad/s",
        (0.2, 10.0),
        start=2.0,
        value=2.0,
        neutral=1.0,
        least=1e-6,
        changes=replaces(Quantity.STRIBECK_RATE),
    )
    reference = (
        "L. C. Bo, D. Pavelescu: The friction-speed relation and its influence on the critical velocity of stick-slip "
        "motion, Wear 82 (3), 1982, 277-289."
    )
    is_linear = False
    nearly_same_as = ("coulomb_friction",)
    separate_by = "Let the robot stand still and start again, often."
