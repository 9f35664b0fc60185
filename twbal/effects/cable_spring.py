"""A cable that pulls the robot back."""

from dataclasses import dataclass

from twbal.core.robot_model import Push
from twbal.core.robot_parameters import RobotParameters
from twbal.effects.effect import OutsideEffect, parameter


@dataclass(frozen=True)
class CableSpring(OutsideEffect):
    """A spring pulls the axle back to where the rollout began.

    It acts at the axle.

    Attributes:
        stiffness: [N/m].
    """

    stiffness: float = parameter("N/m", 0.0, 100.0, 5.0)
    cannot_be_told_from = ("ground_slope",)
    separate_by = "Let the robot drive a long way."

    def __post_init__(self) -> None:
        self._require("stiffness", 0)

    def push(self, robot: RobotParameters) -> Push:
        """The pull of the spring."""
        stiffness = self.stiffness
        return lambda position, time: -stiffness * position
