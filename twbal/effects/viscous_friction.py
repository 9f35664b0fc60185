"""Friction in the wheels' joints that grows with their rate."""

from dataclasses import dataclass

from twbal.core.quantities import Quantity
from twbal.effects.effect import DriveEffect
from twbal.effects.parameter import Scale, adds_to, parameter


@dataclass(frozen=True)
class ViscousFriction(DriveEffect):
    """Each joint resists turning with a torque in proportion to the wheel's rate relative to the body.

    It acts between wheel and body. The motors' back-EMF has exactly this form.
    """

    coefficient: float = parameter(
        "friction of each wheel over its rate",
        "N·m·s/rad",
        (0.0, 1.0),  # the back-EMF of motors that turn at 10 rad/s without load, if torque_limit is the stall torque
        start=0.02,
        value=0.03,
        scale=Scale.TORQUE,
        changes=adds_to(Quantity.VISCOUS_FRICTION),
        is_of_each_wheel=True,
    )
    reference = (
        "B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit: A survey of models, analysis tools and compensation "
        "methods for the control of machines with friction, Automatica 30 (7), 1994, 1083-1138."
    )
    is_linear = True
    nearly_same_as = ("coulomb_friction",)
    separate_by = "Drive at several speeds."
