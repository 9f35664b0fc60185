r"""The planar model about its balance, and its Kalman filter.

About the balance the planar model is x' = F x + w, y = C x + v with x = (θ, φ, θ̇, φ̇), followed by (θ, θ̇) of one control
period before and of two, from which a late IMU reads. v has the sensors' standard deviations; w is what white torques,
one between wheels and body and one on the wheels from outside, do within a control period. Gains are those of the
Kalman filter from the first instant on, where the state is what the first measurement tells. A model discrepancy
(`NoiseModel`) joins the state.
"""

from typing import NamedTuple

import numpy as np

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array
from twbal.planar.actuation import EVEN
from twbal.planar.constants import Constants, constants
from twbal.planar.parameters import PlanarParameters, linear_part
from twbal.planar.planar_plant import hold
from twbal.planar.planar_state import STRAIGHT, PlanarState
from twbal.planar.sensing import imu_settled, sensor_slopes
from twbal.sysid.noise import BIAS_TIME, DISCREPANCY_TIMES, LASTING, SLOWEST_FILTER, UNSENSED, NoiseModel

_INSTANTS = 50  # after which gains have settled
_SETTLED = 1e-4  # change of gains, whose rows are rad, rad/s and N·m for each rad or rad/s that was measured
_IN_READINGS = ((10, 0), (11, 1), (12, 2), (13, 1))  # states of the discrepancy that are errors of a channel, and which
_STEPS = 5  # physics steps of a control period in the linear model


class LinearPlanarModel(NamedTuple):
    """The planar model about its balance, over one control period; S is 8, or 14 with a model discrepancy.

    Attributes:
        F: (S, S).
        C: (4, S).
        B: (S, 2), what the two torques do within the period.
        decay: (6,) of the discrepancy over a control period; empty without one.
        period: control period [s].
        summed: what a gyro's bias adds to the tilt in a control period: that, where a filter adds up the gyro [s].
    """

    F: Array
    C: Array
    B: Array
    decay: Array = np.zeros(0)
    period: float = 0.0
    summed: float = 0.0

    def with_discrepancy(self, period: float, steps: float, filter_rate: float) -> "LinearPlanarModel":
        """The same, with a model discrepancy in the state.

        Args:
            period: control period [s].
            steps: control periods for which the wheel angle shows one value before it steps to the next, in the mean.
            filter_rate: of the complementary filter that the tilt comes from; 0: it comes from none [1/s].
        """
        times, summed = DISCREPANCY_TIMES.copy(), 0.0
        if filter_rate > SLOWEST_FILTER:
            times[2] = 1.0 / filter_rate
        if filter_rate > 0.0:
            summed = period
        states = 8 + LASTING
        F, C, B = np.zeros((states, states)), np.zeros((4, states)), np.zeros((states, 2))
        stays = np.exp(-1.0 / (steps - 1.0)) if steps > 1.0 else 0.0
        decay = np.concatenate([np.exp(-period / times), [0.0, stays, np.exp(-period / BIAS_TIME)]])
        F[:8, :8], F[:8, 8:10], F[8:, 8:] = self.F, self.B, np.diag(decay)
        F[10, 13] = summed
        C[:, :8] = self.C
        for state, channel in _IN_READINGS:
            C[channel, state] = 1.0
        B[:8] = self.B
        return LinearPlanarModel(F, C, B, decay, period, summed)

    @property
    def pushes(self) -> Array:
        """(2, 4), what a torque of the discrepancy adds to tilt, wheel, tilt rate and wheel speed in a period."""
        return np.ascontiguousarray(self.B[:4].T)


class Covariances(NamedTuple):
    """Of the noise that a Kalman filter knows, each linear in the squares of the levels.

    Attributes:
        first: (S, S) of the state at the first instant, after it is read.
        process: (S, S) of what is added to the state in a control period.
        sensors: (4, 4) of the sensors' noise.
    """

    first: Array
    process: Array
    sensors: Array


class Filter(NamedTuple):
    """A Kalman filter, instant by instant; the last row serves all later instants.

    Attributes:
        gains: (G, S, 4).
        whiteners: (G, 4, 4), W with W S Wᵀ = I, S the covariance of the prediction error.
        log_determinants: (G,), of S.
        measured: channels that a sensor measured: the dimension of the prediction errors.
        covariance: (4, 4) of what the corrected tilt, wheel angle, tilt rate and wheel speed are off by, once settled.
        pushes: as of `LinearPlanarModel`.
        decay, summed: as of `LinearPlanarModel`.
    """

    gains: Array
    whiteners: Array
    log_determinants: Array
    measured: int
    covariance: Array
    pushes: Array
    decay: Array
    summed: float


def linearise_period(planar: PlanarParameters, period: float) -> LinearPlanarModel:
    """The linear model, without the effects that are no part of a linear model."""
    smooth = linear_part(planar)
    k: Constants = constants(smooth, period / _STEPS)
    balance = np.array([-k.offset, 0.0, 0.0, 0.0])
    e = 1e-5

    def after(x: Array, torque: float, outside: float) -> Array:
        tilt, wheel, tilt_rate, wheel_speed = x.tolist()
        rest = (0.0,) * (len(PlanarState._fields) - 7)
        state = PlanarState(tilt, wheel, tilt_rate, wheel_speed, 0.0, wheel, wheel_speed, *rest)
        pushed, imu = k._replace(pushed=outside / smooth.wheel_radius), imu_settled(k, state, 2 * _STEPS)
        return np.array(hold(smooth, pushed, state, np.array([torque]), 0, _STEPS, STRAIGHT, imu, EVEN)[:4])

    rest = after(balance, 0.0, 0.0)
    F, B = np.zeros((8, 8)), np.zeros((8, 2))
    for i, direction in enumerate(np.eye(4)):
        F[:4, i] = (after(balance + e * direction, 0.0, 0.0) - rest) / e
    B[:4, 0] = (after(balance, e, 0.0) - rest) / e
    B[:4, 1] = (after(balance, 0.0, e) - rest) / e
    F[4, 0] = F[5, 2] = F[6, 4] = F[7, 5] = 1.0
    return LinearPlanarModel(F, sensor_slopes(smooth) @ _true_readings(k.imu_delay / period), B)


def _true_readings(late: float) -> Array:
    """What sensors without faults show of the state, (4, 8), the IMU being late by so many periods, at most two."""
    C = np.zeros((4, 8))
    late = min(late, 2.0)
    age = min(int(late), 1)
    share = late - age
    tilts, rates = (0, 4, 6), (2, 5, 7)
    C[0, tilts[age]], C[0, tilts[age + 1]] = 1.0 - share, share
    C[1, rates[age]], C[1, rates[age + 1]] = 1.0 - share, share
    C[2, 0], C[2, 1] = -1.0, 1.0
    C[3, 2], C[3, 3] = -1.0, 1.0
    return C


@kernel()
def riccati(F: Array, C: Array, Q: Array, R: Array, P: Array, count: int, settled: float):  # type: ignore[no-untyped-def]
    """Gains, whiteners and log determinants of `count` instants, and the covariance after each, (count, S, S).

    P is the covariance at the first instant, after it is read. Once no gain changes by more than `settled` from one
    instant to the next, all later ones are taken to be alike. The last value returned is the index of that instant,
    beyond which covariances are left 0.
    """
    gains, whiteners = np.zeros((count, len(F), 4)), np.zeros((count, 4, 4))
    determinants, after = np.zeros(count), np.zeros((count, len(F), len(F)))
    eye = np.eye(len(F))
    after[0], last = P, count - 1
    for n in range(1, count):
        P = F @ P @ F.T + Q
        S = C @ P @ C.T + R
        K = np.linalg.solve(S, C @ P).T
        left = eye - K @ C
        P = left @ P @ left.T + K @ R @ K.T
        L = np.linalg.cholesky(S)
        gains[n] = K
        whiteners[n] = np.linalg.inv(L)
        for i in range(4):
            determinants[n] += 2.0 * np.log(L[i, i])
        after[n] = P
        if np.abs(K - gains[n - 1]).max() < settled:
            gains[n:], whiteners[n:], determinants[n:], last = K, whiteners[n], determinants[n], n
            break
    return gains, whiteners, determinants, after, last


def first_reading() -> Array:
    """(8, 4), what the first measurement says of the state."""
    read = np.zeros((8, 4))
    read[:4] = np.linalg.inv([[1, 0, 0, 0], [0, 0, 1, 0], [-1, 1, 0, 0], [0, 0, -1, 1]])
    read[4] = read[6] = read[0]
    read[5] = read[7] = read[2]
    return read


def covariances(linear: LinearPlanarModel, noise: NoiseModel) -> Covariances:
    """Those of a linear model with noise."""
    R = np.diag(noise.sensors**2)
    Q = (linear.B * noise.torques**2) @ linear.B.T
    read = first_reading()
    P = 1.5 * read @ R @ read.T
    if len(linear.decay):
        P, Q = _with_discrepancy(P, Q, read, noise.discrepancy**2, linear)
    return Covariances(P, Q, R)


def _instants(linear: LinearPlanarModel) -> tuple[int, float]:
    """How many instants `riccati` goes through at most, and the change of gains at which it takes them for settled."""
    return _INSTANTS, _SETTLED if len(linear.decay) else 0.0


class Solution(NamedTuple):
    """What `riccati` finds of a linear model with noise.

    Attributes:
        covariances: of the noise.
        gains, whiteners, log_determinants, after, last: as `riccati` returns them.
    """

    covariances: Covariances
    gains: Array
    whiteners: Array
    log_determinants: Array
    after: Array
    last: int

    def filter(self, linear: LinearPlanarModel, noise: NoiseModel) -> Filter:
        """The Kalman filter; nothing is corrected at the first instant."""
        measured = int((noise.sensors < 0.5 * UNSENSED).sum())
        of_linear = linear.pushes, linear.decay, linear.summed
        state = self.after[self.last, :4, :4]
        return Filter(self.gains, self.whiteners, self.log_determinants, measured, state, *of_linear)


def solution(linear: LinearPlanarModel, noise: NoiseModel) -> Solution:
    """Solve the Riccati equation of a linear model with noise.

    Raises:
        LinAlgError: levels are too far apart for the covariance to stay definite.
    """
    of = covariances(linear, noise)
    return Solution(of, *riccati(linear.F, linear.C, of.process, of.sensors, of.first, *_instants(linear)))


def kalman_filter(linear: LinearPlanarModel, noise: NoiseModel) -> Filter:
    """The Kalman filter of a linear model with noise; errors as of `solution`."""
    return solution(linear, noise).filter(linear, noise)


def _with_discrepancy(
    P: Array, Q: Array, read: Array, variances: Array, linear: LinearPlanarModel
) -> tuple[Array, Array]:
    """Covariances (14, 14) of the first state and of the noise, with a stationary model discrepancy.

    Args:
        P: (8, 8) of the first state.
        Q: (14, 14) of the white torques.
        read: (8, 4) what the first measurement says of the state: as much as that is off, so is this.
        variances: (6,) of the discrepancy.
        linear: with it.
    """
    first = np.zeros_like(Q)
    first[:8, :8] = P
    first[8:, 8:] = np.diag(variances)
    for state, channel in _IN_READINGS:
        variance, column = variances[state - 8], read[:, channel]
        first[:8, :8] += variance * np.outer(column, column)
        first[:8, state] = first[state, :8] = -variance * column
    Q = Q.copy()
    Q[8:, 8:] += np.diag((1.0 - linear.decay**2) * variances)
    Q[10, 11] = Q[11, 10] = linear.period * variances[3]
    Q[10, 10] += linear.period**2 * variances[3]
    return first, Q


def error_variances(kalman: Filter) -> Array:
    """(4,) of the prediction errors of a filter that has settled."""
    L = np.linalg.inv(kalman.whiteners[-1])
    return np.asarray(np.diag(L @ L.T))
