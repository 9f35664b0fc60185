"""Motors stronger or weaker than their data sheet."""

from dataclasses import dataclass

import numpy as np

from twbal.core.robot_model import TorqueFilter
from twbal.effects.effect import ActuatorEffect, Place, parameter


@dataclass(frozen=True)
class TorqueGain(ActuatorEffect):
    """Torque is `gain` times what was commanded.

    It acts between the driver (after its dead zone) and the motors. It cannot be told from all masses, inertias and
    frictions divided by the same factor, and hardly from a body mass or a sagging battery.

    Attributes:
        gain: torque over command.
    """

    gain: float = parameter("", 0.3, 2.0, 0.9, none=1.0)
    place = Place.GEAR
    remembers = False
    cannot_be_told_from = ("body_mass", "battery_sag")
    separate_by = "Hold the robot and weigh the force at the wheels, or weigh the body."

    def __post_init__(self) -> None:
        self._require("gain", 0)

    def start(self, physics_step: float, rng: np.random.Generator) -> TorqueFilter:
        """Hand out the gain; it remembers nothing."""
        gain = self.gain
        return lambda u: gain * u
