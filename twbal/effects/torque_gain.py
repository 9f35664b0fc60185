"""Motors stronger or weaker than their data sheet."""

from dataclasses import dataclass

from twbal.effects.effect import DriverEffect, Place
from twbal.effects.parameter import parameter


@dataclass(frozen=True)
class TorqueGain(DriverEffect):
    """Torque is `gain` times what was commanded.

    It acts between the driver (after its dead zone) and the motors. All masses, inertias and frictions divided by the
    same factor are exactly the same to the robot's sensors.
    """

    gain: float = parameter("torque over command", "", (0.3, 2.0), start=0.9, value=0.8, neutral=1.0)
    place = Place.GEAR
    reference = (
        "J. Swevers, W. Verdonck, J. De Schutter: Dynamic model identification for industrial robots, "
        "IEEE Control Systems Magazine 27 (5), 2007, 58-71."
    )
    nearly_same_as = ("body_mass", "battery_sag")
    separate_by = "Hold the robot and weigh the force at the wheels, or weigh the body."

    def drive(self, torque: float, time: float) -> float:
        """What the motors make of it."""
        return self.gain * torque
