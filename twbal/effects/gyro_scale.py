"""A gyro that shows too much or too little."""

from dataclasses import dataclass

from twbal.core.robot_model import Reading
from twbal.effects.effect import ReadingEffect
from twbal.effects.parameter import parameter


@dataclass(frozen=True)
class GyroScale(ReadingEffect):
    """The gyro shows `factor` times the tilt rate.

    It acts on the measured tilt rate, before a bias.
    """

    factor: float = parameter("shown over true rate", "", (0.5, 2.0), start=1.1, value=1.1, neutral=1.0, least=1e-3)
    reference = "D. H. Titterton, J. L. Weston: Strapdown Inertial Navigation Technology, 2nd ed., IET, 2004."
    is_linear = True
    separate_by = "Turn the body by a known angle and integrate the gyro."

    def sense(self, seen: Reading, time: float) -> Reading:
        """Scale the rate."""
        return Reading(seen.tilt, self.factor * seen.tilt_rate, seen.wheel_angle, seen.wheel_rate)

    def correct(self, seen: Reading, time: float) -> Reading:
        """Scale it back."""
        return Reading(seen.tilt, seen.tilt_rate / self.factor, seen.wheel_angle, seen.wheel_rate)
