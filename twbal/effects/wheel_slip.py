"""Tyres that slip."""

from dataclasses import dataclass

from twbal.core.quantities import Quantity
from twbal.core.robot_model import UNBOUNDED
from twbal.effects.effect import GroundEffect
from twbal.effects.parameter import adds_to, limits, parameter


@dataclass(frozen=True)
class WheelSlip(GroundEffect):
    """The tyres' grip is dry friction with a coefficient far below 1.

    It acts between tyre and ground. Only traction beyond the grip tells of it. Rubber yields before it slides: by the
    brush model, a slip at the speed v below that of the `creep`, v_c, makes 1 - (1 - v / v_c)³ of the full traction.
    """

    friction: float = parameter(
        "coefficient of dry friction between tyre and ground",
        "",
        (0.005, 0.9),
        start=0.2,
        value=0.2,
        neutral=UNBOUNDED,
        changes=limits(Quantity.GRIP),
    )
    creep: float = parameter(
        "speed of slip at which the tyres slide",
        "m/s",
        (0.0, 0.15),
        start=0.015,
        value=0.0,
        changes=adds_to(Quantity.TYRE_CREEP),
        is_optional=True,
    )
    reference = "H. B. Pacejka: Tire and Vehicle Dynamics, 3rd ed., Butterworth-Heinemann, 2012."
    is_linear = False
    nearly_same_as = ("torque_saturation",)
    separate_by = (
        "Command large torques for a short while, and measure how far the robot rolls in a turn of its wheels."
    )
