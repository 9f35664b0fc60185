"""Tyres that slip."""

from dataclasses import dataclass

from twbal.core.quantities import Quantity
from twbal.core.robot_model import UNBOUNDED
from twbal.effects.effect import GroundEffect
from twbal.effects.parameter import limits, parameter


@dataclass(frozen=True)
class WheelSlip(GroundEffect):
    """The tyres' grip is dry friction with a coefficient far below 1.

    It acts between tyre and ground. Only traction beyond the grip tells of it.
    """

    friction: float = parameter(
        "coefficient of dry friction between tyre and ground",
        "",
        (0.02, 0.9),
        start=0.2,
        value=0.2,
        neutral=UNBOUNDED,
        changes=limits(Quantity.GRIP),
    )
    reference = "H. B. Pacejka: Tire and Vehicle Dynamics, 3rd ed., Butterworth-Heinemann, 2012."
    is_linear = False
    nearly_same_as = ("torque_saturation",)
    separate_by = (
        "Command large torques for a short while, and measure how far the robot rolls in a turn of its wheels."
    )
