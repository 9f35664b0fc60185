"""White noise on what is measured."""

from dataclasses import astuple, dataclass

import numpy as np

from twbal.core.plant import Observation
from twbal.core.robot_model import SensorFilter
from twbal.effects.effect import Place, SensorEffect
from twbal.effects.parameter import parameter

_MOST = 10.0
_MEANING = "standard deviation of the sensor's noise"


@dataclass(frozen=True)
class SensorNoise(SensorEffect):
    """Independent normal noise is added to every sensor at every control instant.

    It acts on the measurements, after all else. A diagnosis finds it in any case, and does not name it. Where the state
    is fed back, only several instants together tell it from noise in the actuators.
    """

    tilt: float = parameter(_MEANING, "rad", (0.0, _MOST), start=0.0, value=0.0035)
    tilt_rate: float = parameter(_MEANING, "rad/s", (0.0, _MOST), start=0.0, value=0.02)
    acceleration: float = parameter(_MEANING, "m/s²", (0.0, _MOST), start=0.0, value=0.3)
    wheel_angle: float = parameter(_MEANING, "rad", (0.0, _MOST), start=0.0, value=0.001)
    wheel_rate: float = parameter(_MEANING, "rad/s", (0.0, _MOST), start=0.0, value=0.05)
    yaw_rate: float = parameter(_MEANING, "rad/s", (0.0, _MOST), start=0.0, value=0.02)
    place = Place.NOISE
    reference = (
        "N. El-Sheimy, H. Hou, X. Niu: Analysis and modeling of inertial sensors using Allan variance, "
        "IEEE Transactions on Instrumentation and Measurement 57 (1), 2008, 140-149."
    )
    is_linear = False
    separate_by = "Let the robot lie still."

    def start(self, control_period: float, rng: np.random.Generator) -> SensorFilter:
        """Hand out a noise stream."""
        sd = np.array(astuple(self))  # its fields are the sensors of an observation, in their order

        def noisy(truth: Observation) -> Observation:
            values = np.array(truth[1:]) + sd * rng.standard_normal(len(sd))
            return Observation(truth.time, *values.tolist())

        return noisy
