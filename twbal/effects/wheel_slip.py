"""Tyres that slip."""

from dataclasses import dataclass, replace

from twbal.core.robot_model import Ground
from twbal.effects.effect import GroundEffect, parameter


@dataclass(frozen=True)
class WheelSlip(GroundEffect):
    """The tyres' grip is dry friction with a coefficient far below 1.

    It acts between tyre and ground. Only traction beyond the grip tells of it.

    Attributes:
        friction: coefficient.
    """

    friction: float = parameter("", 0.02, 0.9, 0.2, none=1e9)
    cannot_be_told_from = ("torque_saturation",)
    separate_by = (
        "Command large torques for a short while, and measure how far the robot rolls in a turn of its wheels."
    )

    def __post_init__(self) -> None:
        self._require("friction", 0)

    def alter(self, ground: Ground) -> Ground:
        """Cut the grip."""
        return replace(ground, grip=min(ground.grip, self.friction))
