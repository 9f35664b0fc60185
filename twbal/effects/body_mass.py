"""A body heavier or lighter than its data sheet."""

from dataclasses import dataclass, replace

from twbal.core.robot_parameters import RobotParameters
from twbal.effects.effect import BodyEffect, parameter


@dataclass(frozen=True)
class BodyMass(BodyEffect):
    """The body's mass, and its inertia with it, are `factor` times the data sheet's.

    It acts on the body. With all frictions and the wheels' masses scaled alike it would be the inverse of a torque
    gain, and it can hardly be told from one.

    Attributes:
        factor: true mass over the data sheet's.
    """

    factor: float = parameter("", 0.5, 2.0, 1.1, none=1.0)
    cannot_be_told_from = ("torque_gain", "battery_sag")
    separate_by = "Weigh the body."

    def __post_init__(self) -> None:
        self._require("factor", 1e-3)

    def alter(self, robot: RobotParameters) -> RobotParameters:
        """Scale mass and inertia."""
        return replace(
            robot,
            body_mass=self.factor * robot.body_mass,
            body_inertia_pitch=self.factor * robot.body_inertia_pitch,
            body_inertia_roll=self.factor * robot.body_inertia_roll,
            body_inertia_yaw=self.factor * robot.body_inertia_yaw,
        )
