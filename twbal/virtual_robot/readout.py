"""The last of the sensors: mounting angle, the gyro's wandering bias, white noise."""

from dataclasses import astuple

import numpy as np

from twbal.core.plant import Observation
from twbal.virtual_robot.ground_truth import SensorModel


class Readout:
    """Turns what filters and encoders say into what is sent.

    Args:
        sensors: of the robot.
        control_period: [s].
        rng: of one rollout.
        apart: of the same, for the difference of the wheels.

    Attributes:
        bias: of the gyro now [rad/s].
        difference_noise: of the wheels' difference, its angle [rad] and its rate [rad/s], in the last observation.
    """

    def __init__(
        self, sensors: SensorModel, control_period: float, rng: np.random.Generator, apart: np.random.Generator
    ) -> None:
        self._mounting_angle = sensors.mounting_angle
        self._noise = np.array([0.0, *astuple(sensors.noise)])  # the clock is exact
        self._step_of_bias = sensors.gyro_walk * control_period**0.5
        # The mean of two encoders, each with noise, has half the noise of their difference.
        self._difference_noise = 2.0 * np.array([sensors.noise.wheel_angle, sensors.noise.wheel_rate])
        self._rng, self._apart = rng, apart
        self.difference_noise = np.zeros(2)
        self.bias = sensors.gyro_bias

    def let_bias_walk(self) -> None:
        """For one control period."""
        self.bias += self._step_of_bias * float(self._rng.standard_normal())

    def show(self, seen: Observation) -> Observation:
        """With the mounting angle and white noise."""
        values = np.array(seen) + self._noise * self._rng.standard_normal(len(seen))
        values[1] += self._mounting_angle
        self.difference_noise = self._difference_noise * self._apart.standard_normal(2)
        return Observation(*map(float, values))
