"""The last of the sensors: mounting angle, the gyro's wandering bias, white noise."""

from dataclasses import astuple

import numpy as np

from twbal.core.plant import Observation
from twbal.virtual_robot.ground_truth import Sensors


class Readout:
    """Turns what filters and encoders say into what is sent.

    Args:
        sensors: of the robot.
        control_period: [s].
        rng: of one rollout.

    Attributes:
        bias: of the gyro now [rad/s].
    """

    def __init__(self, sensors: Sensors, control_period: float, rng: np.random.Generator) -> None:
        self._mounting_angle = sensors.mounting_angle
        self._noise = np.array([0.0, *astuple(sensors.noise)])  # the clock is exact
        self._step_of_bias = sensors.gyro_walk * control_period**0.5
        self._rng = rng
        self.bias = sensors.gyro_bias

    def let_bias_walk(self) -> None:
        """For one control period."""
        self.bias += self._step_of_bias * float(self._rng.standard_normal())

    def show(self, seen: Observation) -> Observation:
        """With the mounting angle and white noise."""
        values = np.array(seen) + self._noise * self._rng.standard_normal(len(seen))
        values[1] += self._mounting_angle
        return Observation(*map(float, values))
