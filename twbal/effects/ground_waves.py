"""A floor that is not even."""

from dataclasses import dataclass
from math import pi, sin

from twbal.core.robot_model import AxleMotion
from twbal.effects.effect import OutsideEffect
from twbal.effects.parameter import parameter


@dataclass(frozen=True)
class GroundWaves(OutsideEffect):
    """The floor rises and falls: its slope is slope·sin(2π·waves·x + phase), x being the way since the rollout began.

    It acts on the robot's weight, as a force at the axle. It belongs to the place where the robot drove.
    """

    slope: float = parameter("amplitude of the slope", "rad", (0.0, 0.1), start=0.004, value=0.02)
    waves: float = parameter("waves in a metre of way", "1/m", (0.2, 10.0), start=1.5, value=1.5)
    phase: float = parameter(
        "phase where the rollout begins", "rad", (-6.3, 6.3), start=0.0, value=0.0, least=-100.0, below=100.0
    )
    reference = "ISO 8608: Mechanical vibration - Road surface profiles - Reporting of measured data, 2016."
    is_linear = False
    nearly_same_as = ("cogging",)
    separate_by = "Drive elsewhere, or the other way round."

    def push(self, force: float, at: AxleMotion) -> float:
        """Add the pull of the slope."""
        if self.slope == 0.0:
            return force
        return force - at.weight * self.slope * sin(2.0 * pi * self.waves * at.position + self.phase)
