"""Small commands that move nothing."""

from dataclasses import dataclass

from twbal.effects.effect import DriverEffect, Place
from twbal.effects.parameter import Scale, parameter


@dataclass(frozen=True)
class DeadZone(DriverEffect):
    """A dead zone in the motor driver: torque 0 inside ±width, u - sign(u)·width outside (continuous at its edges).

    Forward it ends at width·(1 + skew), backward at width·(1 - skew). It acts on the command, before the gain. While
    the robot keeps moving one way, Coulomb friction of the same size in the joints has the same effect.
    """

    width: float = parameter(
        "half width of the zone, on the summed command", "N·m", (0.0, 5.0), start=0.3, value=1.0, scale=Scale.TORQUE
    )
    skew: float = parameter(
        "share by which it is wider forward and narrower backward",
        "",
        (-0.5, 0.5),
        start=0.0,
        value=0.0,
        least=-1.0,
        below=1.0,
        sd=0.1,
        is_optional=True,
    )
    place = Place.DRIVER
    reference = (
        "G. Tao, P. V. Kokotović: Adaptive Control of Systems with Actuator and Sensor Nonlinearities, Wiley, 1996."
    )
    nearly_same_as = ("coulomb_friction",)
    separate_by = "Command small torques both ways while the robot rolls."

    def drive(self, torque: float, time: float) -> float:
        """What is left of the command."""
        forward, backward = self.width * (1.0 + self.skew), self.width * (1.0 - self.skew)
        if torque > forward:
            return torque - forward
        return torque + backward if torque < -backward else 0.0
