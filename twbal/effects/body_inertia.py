"""A body harder or easier to turn than its data sheet."""

from dataclasses import dataclass, replace

from twbal.core.robot_parameters import RobotParameters
from twbal.effects.effect import BodyEffect, parameter


@dataclass(frozen=True)
class BodyInertia(BodyEffect):
    """The body's inertias about its centre of mass are `factor` times the data sheet's; its mass stays.

    It acts on the body.

    Attributes:
        factor: true inertia over the data sheet's.
    """

    factor: float = parameter("", 0.3, 3.0, 1.2, none=1.0)
    cannot_be_told_from = ("com_height",)
    separate_by = "Hang the body up and time its swing."

    def __post_init__(self) -> None:
        self._require("factor", 1e-3)

    def alter(self, robot: RobotParameters) -> RobotParameters:
        """Scale the inertias."""
        return replace(
            robot,
            body_inertia_pitch=self.factor * robot.body_inertia_pitch,
            body_inertia_roll=self.factor * robot.body_inertia_roll,
            body_inertia_yaw=self.factor * robot.body_inertia_yaw,
        )
