"""Dry friction in the wheels' joints."""

from dataclasses import dataclass

from twbal.core.quantities import Quantity
from twbal.effects.effect import DriveEffect
from twbal.effects.parameter import Scale, adds_to, parameter


@dataclass(frozen=True)
class CoulombFriction(DriveEffect):
    """Each joint resists turning with a constant torque, and sticks where less is asked of it.

    It acts between wheel and body. It looks most like viscous friction on a robot that moves at one speed or not at
    all, and like a dead zone on one that keeps moving one way.
    """

    torque: float = parameter(
        "dry friction of each wheel",
        "N·m",
        (0.0, 2.0),
        start=0.1,
        value=0.3,
        scale=Scale.TORQUE,
        changes=adds_to(Quantity.COULOMB_FRICTION),
        is_of_each_wheel=True,
    )
    reference = (
        "B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit: A survey of models, analysis tools and compensation "
        "methods for the control of machines with friction, Automatica 30 (7), 1994, 1083-1138."
    )
    is_linear = False
    nearly_same_as = ("viscous_friction", "dead_zone")
    separate_by = "Drive at several speeds, both ways."
