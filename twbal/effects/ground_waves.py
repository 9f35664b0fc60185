"""A floor that is not even."""

from dataclasses import dataclass
from math import pi, sin

from twbal.core.robot_model import Push
from twbal.core.robot_parameters import GRAVITY, RobotParameters
from twbal.effects.effect import OutsideEffect, parameter


@dataclass(frozen=True)
class GroundWaves(OutsideEffect):
    """The floor rises and falls: its slope is slope·sin(2π·waves·x + phase), x being the way since the rollout began.

    It acts on the robot's weight, as a force at the axle. No fault of the robot, but of the place where it drove.

    Attributes:
        slope: amplitude [rad].
        waves: a metre of way [1/m].
        phase: [rad].
    """

    slope: float = parameter("rad", 0.0, 0.1, 0.004)
    waves: float = parameter("1/m", 0.2, 10.0, 1.5)
    phase: float = parameter("rad", -3.2, 3.2, 0.0)
    cannot_be_told_from = ("cogging",)
    separate_by = "Drive elsewhere, or the other way round."

    def __post_init__(self) -> None:
        self._require("slope", 0)
        self._require("waves", 0)
        self._require("phase", -100, 100)

    def push(self, robot: RobotParameters) -> Push:
        """The pull of the slope."""
        weight = (robot.body_mass + 2 * robot.wheel_mass) * GRAVITY
        return lambda position, time: -weight * self.slope * sin(2 * pi * self.waves * position + self.phase)
