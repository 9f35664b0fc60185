"""Small commands that move nothing."""

from dataclasses import dataclass
from math import copysign

import numpy as np

from twbal.core.robot_model import TorqueFilter
from twbal.effects.effect import ActuatorEffect, Place, parameter


@dataclass(frozen=True)
class DeadZone(ActuatorEffect):
    """A dead zone in the motor driver: torque 0 inside ±width, u - sign(u)·width outside (continuous at its edges).

    It acts on the command, before the gain. While the robot keeps moving one way it cannot be told from Coulomb
    friction of the same size in the joints.

    Attributes:
        width: half width of the zone, on the summed command [N·m].
    """

    width: float = parameter("N·m", 0.0, 5.0, 0.3, scale="torque")
    place = Place.DRIVER
    remembers = False
    cannot_be_told_from = ("coulomb_friction",)
    separate_by = "Command small torques both ways while the robot rolls."

    def __post_init__(self) -> None:
        self._require("width", 0)

    def start(self, physics_step: float, rng: np.random.Generator) -> TorqueFilter:
        """Hand out the zone; it remembers nothing."""
        width = self.width
        return lambda u: u - copysign(width, u) if abs(u) > width else 0.0
