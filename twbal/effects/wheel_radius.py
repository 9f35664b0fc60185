"""Wheels larger or smaller than their data sheet."""

from dataclasses import dataclass

from twbal.core.quantities import Quantity
from twbal.effects.effect import BodyEffect
from twbal.effects.parameter import parameter, scales


@dataclass(frozen=True)
class WheelRadius(BodyEffect):
    """The wheels' radius is `factor` times the data sheet's; their mass and inertia stay.

    It acts on the body.
    """

    factor: float = parameter(
        "true radius over the data sheet's",
        "",
        (0.5, 2.0),
        start=1.1,
        value=1.1,
        neutral=1.0,
        least=1e-3,
        changes=scales(Quantity.WHEEL_RADIUS),
    )
    reference = (
        "J. Borenstein, L. Feng: Measurement and correction of systematic odometry errors in mobile robots, "
        "IEEE Transactions on Robotics and Automation 12 (6), 1996, 869-880."
    )
    nearly_same_as = ("com_height",)
    separate_by = "Measure how far the robot rolls in a turn of its wheels."
