"""Motors that give less than the data sheet says."""

from dataclasses import dataclass

from twbal.core.robot_model import UNBOUNDED
from twbal.effects.effect import DriverEffect, Place
from twbal.effects.parameter import Scale, parameter


@dataclass(frozen=True)
class TorqueSaturation(DriverEffect):
    """The driver cuts the torque at `limit`, below the limit of the data sheet.

    It acts after the dead zone and before the gain. Only commands beyond it tell of it.
    """

    limit: float = parameter(
        "largest summed torque", "N·m", (0.01, 20.0), start=8.0, value=8.0, neutral=UNBOUNDED, scale=Scale.TORQUE
    )
    place = Place.DRIVER
    reference = (
        "S. Tarbouriech, G. Garcia, J. M. Gomes da Silva Jr., I. Queinnec: Stability and Stabilization of Linear "
        "Systems with Saturating Actuators, Springer, 2011."
    )
    nearly_same_as = ("torque_gain",)
    separate_by = "Command large torques for a short while."

    def drive(self, torque: float, time: float) -> float:
        """What is within the limit."""
        return min(max(torque, -self.limit), self.limit)
