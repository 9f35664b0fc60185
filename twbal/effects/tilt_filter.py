"""A tilt that takes speeding up for leaning."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, cos, expm1, sin
from typing import NamedTuple

import numpy as np

from twbal.core.plant import Observation
from twbal.core.quantities import Quantity
from twbal.core.robot_model import Reading, Sensor, SensorFilter
from twbal.core.robot_parameters import GRAVITY, RobotParameters
from twbal.effects.effect import Effect, Place, SensorEffect, SensorTerm
from twbal.effects.parameter import adds_to, parameter

_FORGETTING = 0.2  # 1/s; from which on all that a sum does not see counts: a filter that never forgets would add it up
HIGHEST = 4.0
"""Radii of the wheels within which an accelerometer is above or below the axle."""


@dataclass(frozen=True)
class TiltFilter(SensorEffect):
    """The tilt comes from a complementary filter, which follows the accelerometer at `rate` = 1/τ.

    Such a filter adds up the gyro once a control period T, and corrects the sum by the direction in which the
    accelerometer sees gravity. When the robot speeds up by a, that direction is wrong by arctan(a/g). So the measured
    tilt is off by e, with e' = -rate·(arctan(a/g) + e) + lead·θ''. It acts on the measured tilt.

    `lead` has two causes. A sum of rectangles runs ahead of the tilt by T/2. An accelerometer at the height h above the
    axle feels h·θ'' as well, which takes rate·h/g from that. So `lead` tells its height, within four radii of the
    wheels, and with it the direction where motions are fast.

    Two more things are a part of e. A torque that comes late changes the tilt rate within a period, which a sum does
    not see. (A torque on time does the same where the readings are late, by `imu_delay`; the planar model alone knows
    of that.) And a gyro that is biased, whose bias walks, or that is scaled shows more than θ'.
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
        """Hand out a settled filter of a perfect gyro and an accelerometer at the axle."""
        return _Fusion(self, (), 0.0).start(control_period, rng)

    def on(self, robot: RobotParameters, effects: Sequence[Effect]) -> Sensor:
        """The filter of a gyro with those of the effects that change its reading.

        What it makes of a bias that walks comes with that (`GyroBiasWalk`), so that both have the same walk.
        """
        gyro = tuple(effect for effect in effects if isinstance(effect, SensorTerm))
        return _Fusion(self, gyro, HIGHEST * robot.wheel_radius)


class _Fusion(NamedTuple):
    """A tilt filter, what changes the readings of its gyro, and how high its accelerometer may be at most [m]."""

    effect: TiltFilter
    gyro: tuple[SensorTerm, ...]
    highest: float

    def start(self, control_period: float, rng: np.random.Generator) -> SensorFilter:
        """As of `TiltFilter`."""
        rate, lead = self.effect.rate, self.effect.lead
        forgetting = Forgetting.of(rate, control_period)
        off, speed = 0.0, 0.0  # tilt that is shown less the true one [rad]
        before: PitchMotion | None = None

        def wrong_rate(truth: Observation, tilt_rate: float) -> float:
            """What the gyro shows too much."""
            seen = Reading(0.0, tilt_rate, 0.0, 0.0)
            for term in self.gyro:
                seen = term.sense(seen, truth.time)
            return seen.tilt_rate - tilt_rate

        def fused(truth: Observation) -> Observation:
            nonlocal off, before, speed
            speed += control_period * truth.acceleration
            now = PitchMotion(truth.tilt, truth.tilt_rate, speed)
            if before is not None and (rate > 0.0 or lead != 0.0):
                faster = now.tilt_rate - before.tilt_rate
                pushed = lead * faster - rate * (now.speed - before.speed) / GRAVITY
                pushed += counted(rate) * unseen_turn(control_period, before, now)
                pushed += beyond_linear(rate, lead, self.highest, control_period, before, now)
                if rate > 0.0:
                    both = wrong_rate(truth, before.tilt_rate) + wrong_rate(truth, truth.tilt_rate)
                    pushed += 0.5 * control_period * both
                off = forgetting.after(off, pushed)
            before = now
            return truth._replace(tilt=truth.tilt + off)

        return fused


class Forgetting(NamedTuple):
    """How a filter of the tilt forgets what it is off by, over a control period.

    Attributes:
        lost: share of it that is lost.
        mean: what is left at the period's end of what came evenly within it.
    """

    lost: float
    mean: float

    @classmethod
    def of(cls, rate: float, control_period: float) -> "Forgetting":
        """That of a filter with a rate [1/s], which may be 0."""
        lost = -expm1(-rate * control_period)
        return cls(lost, lost / (rate * control_period) if rate > 0 else 1.0)

    def after(self, off: float, pushed: float) -> float:
        """What the filter is off by after a period in which so much came in [rad]."""
        return off + (self.mean * pushed - self.lost * off)


class PitchMotion(NamedTuple):
    """What a filter of the tilt feels of a robot at one instant.

    Attributes:
        tilt: [rad].
        tilt_rate: [rad/s].
        speed: of the axle [m/s].
    """

    tilt: float
    tilt_rate: float
    speed: float


def unseen_turn(period: float, before: PitchMotion, now: PitchMotion) -> float:
    """By how much the mean of the tilt rate at both ends of a period tells too large a turn [rad]; also compiled."""
    return 0.5 * period * (before.tilt_rate + now.tilt_rate) - (now.tilt - before.tilt)


def counted(rate: float) -> float:
    """Share of the turns that its sum does not see, which a filter of this rate [1/s] shows; also compiled."""
    return min(rate / _FORGETTING, 1.0)


def beyond_linear(
    rate: float, lead: float, highest: float, period: float, before: PitchMotion, now: PitchMotion
) -> float:
    """What an accelerometer adds in a control period to lead·Δθ' - rate·Δv/g; also compiled for the planar model [rad].

    Args:
        rate, lead: as of `TiltFilter`.
        highest: height above or below the axle at which its accelerometer may be [m].
        period: [s].
        before, now: the motion at the beginning of the period and at its end.
    """
    if rate == 0.0:
        return 0.0
    faster_tilt, faster = now.tilt_rate - before.tilt_rate, now.speed - before.speed
    height = min(max((0.5 * period - lead) * GRAVITY / rate, -highest), highest)
    ahead = faster + height * (now.tilt_rate * cos(now.tilt) - before.tilt_rate * cos(before.tilt))
    above = GRAVITY * period - height * (now.tilt_rate * sin(now.tilt) - before.tilt_rate * sin(before.tilt))
    return rate * ((faster + height * faster_tilt) / GRAVITY - period * atan2(ahead, above))
