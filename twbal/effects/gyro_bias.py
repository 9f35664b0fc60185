"""A gyro that is not at zero at rest."""

from dataclasses import dataclass

from twbal.core.robot_model import Reading
from twbal.effects.effect import Place, ReadingEffect
from twbal.effects.parameter import parameter


@dataclass(frozen=True)
class GyroBias(ReadingEffect):
    """The gyro shows `rate` more than the tilt rate.

    It acts on the measured tilt rate.
    """

    rate: float = parameter(
        "rate that is shown at rest", "rad/s", (-0.3, 0.3), start=0.02, value=0.05, least=-100.0, below=100.0
    )
    place = Place.OFFSET
    reference = "D. H. Titterton, J. L. Weston: Strapdown Inertial Navigation Technology, 2nd ed., IET, 2004."
    is_linear = False
    separate_by = "Let the robot lie still."

    def sense(self, seen: Reading, time: float) -> Reading:
        """Add the bias."""
        return Reading(seen.tilt, seen.tilt_rate + self.rate, seen.wheel_angle, seen.wheel_rate)

    def correct(self, seen: Reading, time: float) -> Reading:
        """Take it off."""
        return Reading(seen.tilt, seen.tilt_rate - self.rate, seen.wheel_angle, seen.wheel_rate)
