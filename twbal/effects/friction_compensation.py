"""Firmware that adds a torque against friction."""

from dataclasses import dataclass

from twbal.effects.effect import DriverEffect, Place
from twbal.effects.parameter import Scale, parameter


@dataclass(frozen=True)
class FrictionCompensation(DriverEffect):
    """Firmware that enlarges every command by `torque` in its direction: u + sign(u)·torque.

    Programs of balancing robots do that so that small commands overcome the friction of the gears. Where the log has
    the command before it is added, the robot answers more strongly to small commands than its data sheet says. It acts
    before the dead zone, which it cancels where both are of one size.
    """

    torque: float = parameter(
        "that is added, on the summed command", "N·m", (0.0, 5.0), start=0.3, value=0.5, scale=Scale.TORQUE
    )
    place = Place.COMMAND
    reference = (
        "H. Olsson, K. J. Åström, C. Canudas de Wit, M. Gäfvert, P. Lischinsky: Friction models and friction "
        "compensation, European Journal of Control 4, 1998."
    )
    nearly_same_as = ("torque_gain",)
    separate_by = "Command small and large torques, with the wheels off the ground: only small ones are changed much."

    def drive(self, torque: float, time: float) -> float:
        """The command and what is added to it; none to a command of 0."""
        if torque > 0.0:
            return torque + self.torque
        return torque - self.torque if torque < 0.0 else 0.0
