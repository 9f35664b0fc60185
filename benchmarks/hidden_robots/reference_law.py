"""A regulator with integral action and friction compensation, designed from the true robot."""

from dataclasses import dataclass
from math import hypot, pi, sqrt, tanh
from typing import NamedTuple

import numpy as np
import scipy.linalg

from benchmarks.hidden_robots.linear_truth import (
    POSITION,
    RATE,
    SPEED,
    TILT,
    LinearTruth,
    Sampled,
    linear_truth,
    sample,
)
from twbal.core.gaussian import Array
from twbal.core.plant import Observation
from twbal.core.robot_parameters import GRAVITY
from twbal.virtual_robot.ground_truth import GroundTruth

_TILT_WIDTH, _RATE_WIDTH, _SPEED_WIDTH = 0.1, 5.0, 5.0  # rad; the next in the robot's own length and time
_LEAST_TORQUE = 1e-3  # of the torque limit, that a design counts on
_LEAST_RATE = 0.2  # over which dry friction turns round [rad/s]; encoders show no less


@dataclass(frozen=True)
class Compensation:
    """How dead zone and dry friction are made up for.

    Attributes:
        zone_share: share of the dead zone.
        dry_share: share of the dry friction.
        width: of torques over which it turns round, as a share of the limit.
        by_rate: dry friction by the wheels' rate and not by the torque's sign.
    """

    zone_share: float
    dry_share: float
    width: float
    by_rate: bool


@dataclass(frozen=True)
class Design:
    """What one controller is made by.

    Attributes:
        torque: usual deviation of the torque, as a share of the limit.
        position: usual deviation of the position [wheel radii].
        integral: of the position's integral [wheel radii, in units of the robot's time of falling].
        friction: how it is compensated.
        disturbance: standard deviation of a torque that the observer allows for, as a share of the limit; None: what is
            measured is taken as it is.
    """

    torque: float
    position: float
    integral: float
    friction: Compensation
    disturbance: float | None


class Seen(NamedTuple):
    """The robot's own measurements about its balance point: tilt, tilt rate, position, speed."""

    tilt: float
    rate: float
    position: float
    speed: float


class Law:
    """u(measurements so far); one for each trial.

    Args:
        truth: the robot.
        design: what the gains come from.
        period: control period [s].
    """

    def __init__(self, truth: GroundTruth, design: Design, period: float) -> None:
        self._truth, self._design, self._period = truth, design, period
        self._model = model = linear_truth(truth)
        self._sampled = sample(model, period)
        self._limit = truth.drive.torque_limit
        self._gain_of_motors = 0.5 * sum(truth.drive.gain)
        self._gains = gains(model, self._sampled, design, period, self._gain_of_motors * self._limit)
        self._correction = (
            None if design.disturbance is None else observer(truth, model, self._sampled, design.disturbance, period)
        )
        self._most = self._torque_at_the_limit()
        self.begin()

    def begin(self) -> None:
        """Forget: a new trial begins."""
        self._past = [0.0] * (self._sampled.whole + 2)
        self._integral, self._start = 0.0, 0.0
        self._led_astray, self._speed_before = 0.0, 0.0
        self._estimate: Array | None = None

    def command(self, seen: Observation) -> float:
        """What to send, cut at the torque limit [N·m]."""
        x = self._state(self._about_balance(seen))
        self._integral += x[POSITION] * self._period
        z = np.array([*x, self._integral, *self._past[:-1]])
        torque = min(max(float(-self._gains @ z), -self._most), self._most)
        self._past = [torque, *self._past[:-1]]
        rate = x[SPEED] / self._model.radius - x[RATE]
        return min(max(self._compensated(torque + self._model.holding, rate), -self._limit), self._limit)

    def _about_balance(self, seen: Observation) -> Seen:
        """Measurements without what the truth knows to be wrong: bias, mounting, speeding up taken for leaning."""
        model, sensors = self._model, self._truth.sensors
        rate = seen.tilt_rate - sensors.gyro_bias
        speed = model.radius * (seen.wheel_rate + rate)
        place = model.radius * (seen.wheel_angle + seen.tilt)
        if seen.time == 0.0:
            self._start = place
        elif sensors.fusion_time:
            self._led_astray -= (
                (speed - self._speed_before) / GRAVITY + self._led_astray * self._period
            ) / sensors.fusion_time
        self._speed_before = speed
        return Seen(seen.tilt - model.shown - self._led_astray, rate, place - self._start, speed)

    def _state(self, seen: Seen) -> Array:
        """(4,) as measured, or as the observer has it."""
        measured = np.array(seen)
        if self._correction is None:
            return measured
        if self._estimate is None:
            self._estimate = measured
            return measured
        s = self._sampled
        predicted = s.A @ self._estimate + s.early * self._past[s.whole] + s.late * self._past[s.whole + 1]
        self._estimate = predicted + self._correction @ (measured - predicted)
        return self._estimate

    def _compensated(self, torque: float, rate: float) -> float:
        """The command that makes up for motors, dead zone and dry friction; `rate` is the wheels' [rad/s]."""
        drive, friction, how = self._truth.drive, self._truth.friction, self._design.friction
        width = how.width * self._limit * self._gain_of_motors
        opposed = rate / max(friction.stribeck_rate, _LEAST_RATE) if how.by_rate else torque / width
        asked = torque + how.dry_share * 2.0 * friction.coulomb * tanh(opposed)
        zone = drive.dead_zone[0] if asked > 0.0 else drive.dead_zone[1]
        return asked / self._gain_of_motors + how.zone_share * zone * tanh(asked / width)

    def _torque_at_the_limit(self) -> float:
        """That a command at the limit comes to, about [N·m]."""
        lost = 0.5 * sum(self._truth.drive.dead_zone)
        return max(self._gain_of_motors * (self._limit - lost), _LEAST_TORQUE * self._limit)


def gains(model: LinearTruth, sampled: Sampled, design: Design, period: float, most: float) -> Array:
    """(5 + whole + 1,) K of τ = -K z, z = (x, integral of the position, past torques).

    Args:
        model: the robot.
        sampled: it, sampled.
        design: usual deviations of what is weighed (Bryson's rule).
        period: control period [s].
        most: torque at the limit [N·m].
    """
    past = sampled.whole + 1
    A, B = np.zeros((5 + past, 5 + past)), np.zeros((5 + past, 1))
    A[:4, :4] = sampled.A
    A[4, 4], A[4, POSITION] = 1.0, period
    A[:4, 4 + past] = sampled.late
    if sampled.whole:
        A[:4, 3 + past] = sampled.early
    else:
        B[:4, 0] = sampled.early
    B[5, 0] = 1.0
    A[range(6, 5 + past), range(5, 4 + past)] = 1.0
    fall = falling_time(model)
    usual = np.empty(5)
    usual[TILT], usual[RATE] = _TILT_WIDTH, _RATE_WIDTH * _TILT_WIDTH / fall
    usual[POSITION] = design.position * model.radius
    usual[SPEED] = _SPEED_WIDTH * model.radius / fall
    usual[4] = design.integral * model.radius * fall
    Q = np.diag([*usual**-2.0, *[1e-9 * most**-2.0] * past])
    R = np.array([[(design.torque * most) ** -2.0]])
    P = scipy.linalg.solve_discrete_are(A, B, Q, R)
    found: Array = np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)[0]
    return found


def observer(truth: GroundTruth, model: LinearTruth, sampled: Sampled, disturbance: float, period: float) -> Array:
    """(4, 4) of a Kalman filter that corrects (tilt, rate, position, speed) by measurements of them.

    Args:
        truth: for the noise of its sensors.
        model, sampled: the robot.
        disturbance: torque that the model does not know, as a share of the limit.
        period: control period [s].
    """
    noise, sensors = truth.sensors.noise, truth.sensors
    tick = 2.0 * pi / sensors.ticks if sensors.ticks else 1e-4
    window = sensors.rate_window or period
    deviations = np.array(
        [
            hypot(noise.tilt, 1e-4),
            hypot(noise.tilt_rate, 1e-3),
            model.radius * hypot(tick / sqrt(12.0), noise.tilt),
            model.radius * hypot(tick / window / sqrt(6.0), noise.tilt_rate),
        ]
    )
    push = (sampled.early + sampled.late) * disturbance * truth.drive.torque_limit
    W = np.outer(push, push) + 1e-12 * np.eye(4)
    V = np.diag(deviations**2)
    P = scipy.linalg.solve_discrete_are(sampled.A.T, np.eye(4), W, V)
    correction: Array = np.linalg.solve(P + V, P).T
    return correction


def falling_time(model: LinearTruth) -> float:
    """Time in which the robot that is let go falls e times as far [s]."""
    return float(1.0 / np.linalg.eigvals(model.A).real.max())
