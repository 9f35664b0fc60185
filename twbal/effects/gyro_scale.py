"""A gyro that shows too much or too little."""

from dataclasses import dataclass

import numpy as np

from twbal.core.robot_model import SensorFilter
from twbal.effects.effect import SensorEffect, parameter


@dataclass(frozen=True)
class GyroScale(SensorEffect):
    """The gyro shows `factor` times the tilt rate.

    It acts on the measured tilt rate, before a bias.

    Attributes:
        factor: shown over true.
    """

    factor: float = parameter("", 0.5, 2.0, 1.1, none=1.0)
    cannot_be_told_from = ()
    separate_by = "Turn the body by a known angle and integrate the gyro."

    def __post_init__(self) -> None:
        self._require("factor", 1e-3)

    def start(self, control_period: float, rng: np.random.Generator) -> SensorFilter:
        """Hand out the gyro; it remembers nothing."""
        return lambda truth: truth._replace(tilt_rate=self.factor * truth.tilt_rate)
