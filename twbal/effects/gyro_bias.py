"""A gyro that is not at zero at rest."""

from dataclasses import dataclass

import numpy as np

from twbal.core.robot_model import SensorFilter
from twbal.effects.effect import Place, SensorEffect, parameter


@dataclass(frozen=True)
class GyroBias(SensorEffect):
    """The gyro shows `rate` more than the tilt rate.

    It acts on the measured tilt rate.

    Attributes:
        rate: [rad/s].
    """

    rate: float = parameter("rad/s", -0.3, 0.3, 0.02)
    place = Place.OFFSET
    cannot_be_told_from = ()
    separate_by = "Let the robot lie still."

    def __post_init__(self) -> None:
        self._require("rate", -100, 100)

    def start(self, control_period: float, rng: np.random.Generator) -> SensorFilter:
        """Hand out the gyro; it remembers nothing."""
        return lambda truth: truth._replace(tilt_rate=truth.tilt_rate + self.rate)
