"""A tilt that takes speeding up for leaning."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan, expm1
from typing import NamedTuple

import numpy as np

from twbal.core.plant import Observation
from twbal.core.quantities import Quantity
from twbal.core.robot_model import Reading, Sensor, SensorFilter
from twbal.core.robot_parameters import GRAVITY
from twbal.effects.effect import Effect, Place, SensorEffect, SensorTerm
from twbal.effects.parameter import adds_to, parameter


@dataclass(frozen=True)
class TiltFilter(SensorEffect):
    """The tilt comes from a complementary filter, which follows the accelerometer at `rate` = 1/τ.

    Such a filter adds up the gyro and corrects the sum by the direction in which the accelerometer sees gravity. When
    the robot speeds up by a, that direction is wrong by arctan(a/g). So the measured tilt is off by e, with
    e' = -rate·(arctan(a/g) + e) + lead·θ''. A sum of rectangles, a control period T wide, runs ahead of the tilt by
    T/2; an accelerometer at the height h above the axle takes rate·h/g from that. What a biased or scaled gyro shows
    beyond θ' is added up as well: it is a further part of e'. It acts on the measured tilt.
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
        """Hand out a filter of a perfect gyro that has settled at the first instant."""
        return _Fusion(self, ()).start(control_period, rng)

    def beside(self, effects: Sequence[Effect]) -> Sensor:
        """The filter of a gyro with those of the effects that change its reading."""
        return _Fusion(self, tuple(effect for effect in effects if isinstance(effect, SensorTerm)))


class _Fusion(NamedTuple):
    """A tilt filter, and what changes the readings of its gyro."""

    effect: TiltFilter
    gyro: tuple[SensorTerm, ...]

    def start(self, control_period: float, rng: np.random.Generator) -> SensorFilter:
        """As of `TiltFilter`."""
        rate, lead = self.effect.rate, self.effect.lead
        lost = -expm1(-rate * control_period)
        mean = lost / (rate * control_period) if rate > 0 else 1.0  # of exp(-rate·t) over a period
        off = 0.0  # tilt that is shown less the true one [rad]
        before: float | None = None

        def wrong_rate(truth: Observation, tilt_rate: float) -> float:
            """What the gyro shows too much."""
            seen = Reading(0.0, tilt_rate, 0.0, 0.0)
            for term in self.gyro:
                seen = term.sense(seen, truth.time)
            return seen.tilt_rate - tilt_rate

        def fused(truth: Observation) -> Observation:
            nonlocal off, before
            if before is not None:
                wrong = atan(truth.acceleration / GRAVITY)
                pushed = lead * (truth.tilt_rate - before) - rate * control_period * wrong
                if rate > 0.0:
                    both = wrong_rate(truth, before) + wrong_rate(truth, truth.tilt_rate)
                    pushed += 0.5 * control_period * both
                off += mean * pushed - lost * off
            before = truth.tilt_rate
            return truth._replace(tilt=truth.tilt + off)

        return fused
