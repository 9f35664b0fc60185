"""A tilt that takes speeding up for leaning."""

from dataclasses import dataclass
from math import expm1

import numpy as np

from twbal.core.plant import Observation
from twbal.core.quantities import Quantity
from twbal.core.robot_model import SensorFilter
from twbal.core.robot_parameters import GRAVITY
from twbal.effects.effect import Place, SensorEffect
from twbal.effects.parameter import adds_to, parameter


@dataclass(frozen=True)
class TiltFilter(SensorEffect):
    """The tilt comes from a complementary filter, which follows the accelerometer at `rate` = 1/τ.

    Such a filter integrates the gyro and corrects the sum by the direction in which the accelerometer sees gravity.
    When the robot speeds up, that direction is wrong by a/g, a being the accelerometer's acceleration: forward, of the
    axle, and `height` times the angular acceleration of the body. So the measured tilt is off by e, with
    e' = -rate·(a/g + e). It acts on the measured tilt.
    """

    rate: float = parameter(
        "1/τ, at which the filter follows the accelerometer",
        "1/s",
        (0.0, 5.0),
        start=0.5,
        value=1.0,
        below=1000.0,
        changes=adds_to(Quantity.TILT_FILTER_RATE),
    )
    height: float = parameter(
        "of the accelerometer above the axle",
        "m",
        (-0.1, 0.5),
        start=0.0,
        value=0.0,
        least=-10.0,
        below=10.0,
        changes=adds_to(Quantity.IMU_HEIGHT),
    )
    place = Place.FUSION
    reference = (
        "W. T. Higgins: A comparison of complementary and Kalman filtering, IEEE Transactions on Aerospace and "
        "Electronic Systems AES-11 (3), 1975, 321-325."
    )
    is_linear = False
    separate_by = "Hold the body upright against a wall or rail, push the robot to and fro, and look at the tilt."

    def start(self, control_period: float, rng: np.random.Generator) -> SensorFilter:
        """Hand out a filter that has settled at the first instant."""
        lost = -expm1(-self.rate * control_period)
        mean = lost / (self.rate * control_period) if self.rate > 0 else 1.0  # of exp(-rate·t) over a period
        behind = 0.0  # the accelerometer's speed, less what the filter has followed of it [m/s]
        before: float | None = None

        def fused(truth: Observation) -> Observation:
            nonlocal behind, before
            turned = 0.0 if before is None else truth.tilt_rate - before
            gained = 0.0 if before is None else truth.acceleration * control_period
            before = truth.tilt_rate
            behind += mean * (gained + self.height * turned) - lost * behind
            return truth._replace(tilt=truth.tilt - behind * self.rate / GRAVITY)

        return fused
