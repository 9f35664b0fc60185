"""White noise on what is measured."""

from dataclasses import dataclass, fields

import numpy as np

from twbal.core.plant import Observation
from twbal.core.robot_model import SensorFilter
from twbal.effects.effect import Place, SensorEffect


@dataclass(frozen=True)
class SensorNoise(SensorEffect):
    """Independent normal noise is added to every sensor at every control instant.

    It acts on the measurements, after all else. Where the state is fed back, it cannot be told from noise in the
    actuators without a look at several instants together.

    Attributes:
        tilt: standard deviation [rad].
        tilt_rate: [rad/s].
        acceleration: [m/s²].
        wheel_angle: [rad].
        wheel_rate: [rad/s].
        yaw_rate: [rad/s].
    """

    tilt: float
    tilt_rate: float
    acceleration: float
    wheel_angle: float
    wheel_rate: float
    yaw_rate: float
    place = Place.NOISE

    def __post_init__(self) -> None:
        for field in fields(self):
            self._require(field.name, 0)

    def start(self, control_period: float, rng: np.random.Generator) -> SensorFilter:
        """Hand out a noise stream."""
        sd = np.array([getattr(self, name) for name in Observation._fields[1:]])

        def noisy(truth: Observation) -> Observation:
            values = np.array(truth[1:]) + sd * rng.standard_normal(len(sd))
            return Observation(truth.time, *values.tolist())

        return noisy
