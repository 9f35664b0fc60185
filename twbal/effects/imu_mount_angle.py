"""A tilt sensor mounted askew."""

from dataclasses import dataclass

import numpy as np

from twbal.core.robot_model import SensorFilter
from twbal.effects.effect import Place, SensorEffect, parameter


@dataclass(frozen=True)
class ImuMountAngle(SensorEffect):
    """The measured tilt is `angle` more than the true one.

    It acts on the measured tilt. It cannot be told from an offset of the centre of mass.

    Attributes:
        angle: [rad].
    """

    angle: float = parameter("rad", -0.15, 0.15, 0.02)
    place = Place.OFFSET
    same_as = ("com_offset",)
    cannot_be_told_from = ("com_offset",)
    separate_by = "Measure the IMU against the body."

    def __post_init__(self) -> None:
        self._require("angle", -1.5, 1.5)

    def start(self, control_period: float, rng: np.random.Generator) -> SensorFilter:
        """Hand out the sensor; it remembers nothing."""
        return lambda truth: truth._replace(tilt=truth.tilt + self.angle)
