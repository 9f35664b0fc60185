"""Something that shakes the robot."""

from dataclasses import dataclass
from math import pi, sin

from twbal.core.robot_model import Push
from twbal.core.robot_parameters import RobotParameters
from twbal.effects.effect import OutsideEffect, parameter


@dataclass(frozen=True)
class PeriodicDisturbance(OutsideEffect):
    """A force at the axle, force·sin(2π·frequency·t + phase), t being the time since the rollout began.

    It acts at the axle.

    Attributes:
        force: amplitude [N].
        frequency: [Hz].
        phase: [rad].
    """

    force: float = parameter("N", 0.0, 50.0, 3.0)
    frequency: float = parameter("Hz", 0.05, 12.0, 1.0)
    phase: float = parameter("rad", -3.2, 3.2, 0.0)
    cannot_be_told_from = ("cogging",)
    separate_by = "Let the robot stand where nothing moves."

    def __post_init__(self) -> None:
        self._require("force", 0)
        self._require("frequency", 0)
        self._require("phase", -100, 100)

    def push(self, robot: RobotParameters) -> Push:
        """The shaking force."""
        return lambda position, time: self.force * sin(2 * pi * self.frequency * time + self.phase)
