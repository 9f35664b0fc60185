"""Small commands that move nothing."""

from dataclasses import dataclass

from twbal.effects.effect import DriverEffect, Place
from twbal.effects.parameter import Scale, parameter


@dataclass(frozen=True)
class DeadZone(DriverEffect):
    """A dead zone in the motor driver: torque 0 inside ±width, u - sign(u)·width outside (continuous at its edges).

    It acts on the command, before the gain. While the robot keeps moving one way, Coulomb friction of the same size in
    the joints has the same effect.
    """

    width: float = parameter(
        "half width of the zone, on the summed command", "N·m", (0.0, 5.0), start=0.3, value=1.0, scale=Scale.TORQUE
    )
    place = Place.DRIVER
    reference = (
        "G. Tao, P. V. Kokotović: Adaptive Control of Systems with Actuator and Sensor Nonlinearities, Wiley, 1996."
    )
    nearly_same_as = ("coulomb_friction",)
    separate_by = "Command small torques both ways while the robot rolls."

    def drive(self, torque: float, time: float) -> float:
        """What is left of the command."""
        if torque > self.width:
            return torque - self.width
        return torque + self.width if torque < -self.width else 0.0
