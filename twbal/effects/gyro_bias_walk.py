"""A gyro whose bias walks."""

from dataclasses import dataclass

import numpy as np

from twbal.core.plant import Observation
from twbal.core.robot_model import SensorFilter
from twbal.effects.effect import Place, SensorEffect
from twbal.effects.parameter import parameter


@dataclass(frozen=True)
class GyroBiasWalk(SensorEffect):
    """The gyro's bias does a random walk from 0: over t seconds its standard deviation grows to `density`·√t.

    It acts on the measured tilt rate. It is a change of the noise, so that no prediction of the motion shows it, and
    the planar model does without it. A diagnosis tells it from the noise that it fits, and names no effect for it.
    """

    density: float = parameter(
        "by which the bias walks in a second", "rad/s/√s", (0.0, 0.1), start=0.001, value=0.001, below=100.0
    )
    place = Place.OFFSET
    diagnosed_separately = True
    reference = (
        "N. El-Sheimy, H. Hou, X. Niu: Analysis and modeling of inertial sensors using Allan variance, "
        "IEEE Transactions on Instrumentation and Measurement 57 (1), 2008, 140-149."
    )
    is_linear = False
    separate_by = "Let the robot lie still for minutes, and look at the Allan variance of the gyro."

    def start(self, control_period: float, rng: np.random.Generator) -> SensorFilter:
        """Hand out a gyro without a bias."""
        step, bias = self.density * control_period**0.5, 0.0

        def walking(truth: Observation) -> Observation:
            nonlocal bias
            shown = truth._replace(tilt_rate=truth.tilt_rate + bias)
            bias += step * float(rng.standard_normal())
            return shown

        return walking
