"""A centre of mass higher or lower than the data sheet's."""

from dataclasses import dataclass, replace

from twbal.core.robot_parameters import RobotParameters
from twbal.effects.effect import BodyEffect, parameter


@dataclass(frozen=True)
class ComHeight(BodyEffect):
    """The centre of mass is `factor` times as far from the axle; the inertia about it stays.

    It acts on the body. It can hardly be told from the wheels' radius.

    Attributes:
        factor: true height over the data sheet's.
    """

    factor: float = parameter("", 0.5, 2.0, 1.1, none=1.0)
    cannot_be_told_from = ("wheel_radius",)
    separate_by = "Measure the wheels, or hang the body up and time its swing."

    def __post_init__(self) -> None:
        self._require("factor", 1e-3)

    def alter(self, robot: RobotParameters) -> RobotParameters:
        """Scale the height."""
        return replace(robot, com_height=self.factor * robot.com_height)
