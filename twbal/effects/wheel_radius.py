"""Wheels larger or smaller than their data sheet."""

from dataclasses import dataclass, replace

from twbal.core.robot_parameters import RobotParameters
from twbal.effects.effect import BodyEffect, parameter


@dataclass(frozen=True)
class WheelRadius(BodyEffect):
    """The wheels' radius is `factor` times the data sheet's; their mass and inertia stay.

    It acts on the body. It can hardly be told from the height of the centre of mass.

    Attributes:
        factor: true radius over the data sheet's.
    """

    factor: float = parameter("", 0.5, 2.0, 1.1, none=1.0)
    cannot_be_told_from = ("com_height",)
    separate_by = "Measure how far the robot rolls in a turn of its wheels."

    def __post_init__(self) -> None:
        self._require("factor", 1e-3)

    def alter(self, robot: RobotParameters) -> RobotParameters:
        """Scale the radius."""
        return replace(robot, wheel_radius=self.factor * robot.wheel_radius)
