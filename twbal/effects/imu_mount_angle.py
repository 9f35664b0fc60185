"""A tilt sensor mounted askew."""

from dataclasses import dataclass

from twbal.core.robot_model import Reading
from twbal.effects.effect import Place, ReadingEffect
from twbal.effects.parameter import parameter


@dataclass(frozen=True)
class ImuMountAngle(ReadingEffect):
    """The measured tilt is `angle` more than the true one.

    It acts on the measured tilt. An offset of the centre of mass by the same angle is exactly the same to the robot's
    sensors.
    """

    angle: float = parameter(
        "measured less true tilt", "rad", (-0.15, 0.15), start=0.02, value=0.035, least=-1.5, below=1.5
    )
    place = Place.OFFSET
    reference = (
        "D. Tedaldi, A. Pretto, E. Menegatti: A robust and easy to implement method for IMU calibration without "
        "external equipments, IEEE International Conference on Robotics and Automation, 2014, 3042-3049."
    )
    is_linear = False
    same_as = ("com_offset",)
    nearly_same_as = ("com_offset",)
    separate_by = "Measure the IMU against the body."

    def sense(self, seen: Reading, time: float) -> Reading:
        """Add the angle."""
        return Reading(seen.tilt + self.angle, seen.tilt_rate, seen.wheel_angle, seen.wheel_rate)

    def correct(self, seen: Reading, time: float) -> Reading:
        """Take it off."""
        return Reading(seen.tilt - self.angle, seen.tilt_rate, seen.wheel_angle, seen.wheel_rate)
