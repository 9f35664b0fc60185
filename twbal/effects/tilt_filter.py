"""A tilt that takes speeding up for leaning."""

from dataclasses import dataclass
from math import atan, expm1

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

    Such a filter adds up the gyro and corrects the sum by the direction in which the accelerometer sees gravity. When
    the robot speeds up by a, that direction is wrong by arctan(a/g). So the measured tilt is off by e, with
    e' = -rate·(arctan(a/g) + e) + lead·θ''. A sum of rectangles, a control period T wide, runs ahead of the tilt by
    T/2; an accelerometer at the height h above the axle takes rate·h/g from that. It acts on the measured tilt.
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
    lead: float = parameter(
        "by which the sum of the gyro runs ahead of the tilt",
        "s",
        (-0.15, 0.05),
        start=0.0,
        value=0.01,
        least=-10.0,
        below=10.0,
        changes=adds_to(Quantity.TILT_FILTER_LEAD),
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
        off = 0.0  # tilt that is shown less the true one [rad]
        before: float | None = None

        def fused(truth: Observation) -> Observation:
            nonlocal off, before
            if before is not None:
                wrong = atan(truth.acceleration / GRAVITY)
                pushed = self.lead * (truth.tilt_rate - before) - self.rate * control_period * wrong
                off += mean * pushed - lost * off
            before = truth.tilt_rate
            return truth._replace(tilt=truth.tilt + off)

        return fused
