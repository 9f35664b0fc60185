r"""Noise of a predictor, its gain, and its likelihood.

About the balance the twin is x' = F x + w, y = C x + v with x = (θ, φ, θ̇, φ̇), followed by (θ, θ̇) of one control period
before and of two, from which a late IMU reads. v has the sensors' standard deviations; w is what white torques, one
between wheels and body and one on the wheels from outside, do within a control period. Gains are those of the Kalman
filter from the first instant on, where the state is what the first measurement tells.

Another gain K' in place of K changes the prediction errors as the linear twin says,

    e'_n = e_n - C δ_n,   δ_{n+1} = F (δ_n + K'_n e'_n - K_n e_n),   δ_0 = 0,

so noise is fitted without running the twin again.

Prediction errors are taken to be of Student's t distribution, with the filter's covariance and as many dimensions as
channels were measured: a shove or a landing at the start then bears on the fit by no more than a few ordinary instants.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array
from twbal.planar.constants import Constants, constants
from twbal.planar.parameters import TwinParameters, linear_part
from twbal.planar.planar_plant import hold
from twbal.planar.sensing import sensor_slopes
from twbal.planar.twin_state import STRAIGHT, TwinState
from twbal.sysid.recording import Mask

_INSTANTS = 50  # after which gains have settled
_IMPOSSIBLE = 1e12
UNSENSED = 100.0
"""Standard deviation of a channel that was not measured [rad, rad/s]: so large that it corrects nothing."""
_TAIL = 10.0  # degrees of freedom of the errors' distribution
_STEPS = 5  # physics steps of a control period in the linear model


class Noise(NamedTuple):
    """Levels of noise.

    Attributes:
        sensors: (4,) standard deviations, in the order of `MEASURED`.
        torques: (2,) standard deviations of the mean torque of a control period: at the joints, and from outside on
            the wheels [N·m].
    """

    sensors: Array
    torques: Array


class LinearTwin(NamedTuple):
    """The twin about its balance, over one control period.

    Attributes:
        F: (8, 8).
        C: (4, 8).
        B: (8, 2), what the two torques do within the period.
    """

    F: Array
    C: Array
    B: Array


class Filter(NamedTuple):
    """A Kalman filter, instant by instant; the last row serves all later instants.

    Attributes:
        gains: (G, 8, 4).
        whiteners: (G, 4, 4), W with W S Wᵀ = I, S the covariance of the prediction error.
        log_determinants: (G,), of S.
        measured: channels that a sensor measured: the dimension of the prediction errors.
    """

    gains: Array
    whiteners: Array
    log_determinants: Array
    measured: int


def linearise_period(twin: TwinParameters, period: float) -> LinearTwin:
    """The linear twin, without the effects that are no part of a linear model."""
    smooth = linear_part(twin)
    k: Constants = constants(smooth, period / _STEPS)
    balance = np.array([-k.offset, 0.0, 0.0, 0.0])
    e = 1e-5

    def after(x: Array, torque: float, outside: float) -> Array:
        tilt, wheel, tilt_rate, wheel_speed = x.tolist()
        state = TwinState(tilt, wheel, tilt_rate, wheel_speed, 0.0, wheel, wheel_speed, 0.0, 0.0)
        pushed, imu = k._replace(pushed=outside / smooth.wheel_radius), np.zeros((2 * _STEPS, 2))
        return np.array(hold(smooth, pushed, state, np.array([torque]), 0, _STEPS, STRAIGHT, imu)[:4])

    rest = after(balance, 0.0, 0.0)
    F, B = np.zeros((8, 8)), np.zeros((8, 2))
    for i, direction in enumerate(np.eye(4)):
        F[:4, i] = (after(balance + e * direction, 0.0, 0.0) - rest) / e
    B[:4, 0] = (after(balance, e, 0.0) - rest) / e
    B[:4, 1] = (after(balance, 0.0, e) - rest) / e
    F[4, 0] = F[5, 2] = F[6, 4] = F[7, 5] = 1.0
    return LinearTwin(F, sensor_slopes(smooth) @ _true_readings(k.imu_delay / period), B)


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
def _riccati(F: Array, C: Array, Q: Array, R: Array, P: Array, count: int):  # type: ignore[no-untyped-def]
    """Gains, whiteners and log determinants of `count` instants; P is the covariance at the first, after it is read."""
    gains, whiteners = np.zeros((count, 8, 4)), np.zeros((count, 4, 4))
    determinants = np.zeros(count)
    eye = np.eye(8)
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
    return gains, whiteners, determinants


def kalman_filter(linear: LinearTwin, noise: Noise) -> Filter:
    """The Kalman filter of a linear twin with noise; nothing is corrected at the first instant."""
    R = np.diag(noise.sensors**2)
    Q = (linear.B * noise.torques**2) @ linear.B.T
    read = np.zeros((8, 4))  # what the first measurement says of the state
    read[:4] = np.linalg.inv([[1, 0, 0, 0], [0, 0, 1, 0], [-1, 1, 0, 0], [0, 0, -1, 1]])
    read[4] = read[6] = read[0]
    read[5] = read[7] = read[2]
    P = 1.5 * read @ R @ read.T
    measured = int((noise.sensors < 0.5 * UNSENSED).sum())
    gains, whiteners, determinants = _riccati(linear.F, linear.C, Q, R, P, _INSTANTS)
    return Filter(gains, whiteners, determinants, measured)


@kernel()
def _refilter(F: Array, C: Array, old: Array, new: Array, errors: Array) -> Array:
    """Prediction errors with other gains, by the linear twin."""
    changed = np.empty_like(errors)
    delta, moved = np.zeros(8), np.empty(8)
    last = len(old) - 1
    for n in range(len(errors)):
        K, L = old[min(n, last)], new[min(n, last)]
        for j in range(4):
            seen = 0.0
            for i in range(8):
                seen += C[j, i] * delta[i]
            changed[n, j] = errors[n, j] - seen
        for i in range(8):
            moved[i] = delta[i]
            for j in range(4):
                moved[i] += L[i, j] * changed[n, j] - K[i, j] * errors[n, j]
        for i in range(8):
            delta[i] = 0.0
            for j in range(8):
                delta[i] += F[i, j] * moved[j]
    return changed


@kernel()
def _square(errors: Array, W: Array, white: Array) -> float:
    """Squared length of W e, which is written to `white`."""
    total = 0.0
    for i in range(4):
        white[i] = 0.0
        for j in range(i + 1):
            white[i] += W[i, j] * errors[j]
        total += white[i] * white[i]
    return total


@kernel()
def _heavy(square: float, dimension: int) -> float:
    """-2 log density, but for a constant, of errors of a squared length: Student's t of unit covariance."""
    tail: float = (_TAIL + dimension) * np.log1p(square / (_TAIL - 2.0))
    return tail


@kernel()
def _cost(errors: Array, usable: Mask, whiteners: Array, determinants: Array, dimension: int) -> float:
    """-2 log likelihood of prediction errors, but for a constant; the first instant does not count."""
    total = 0.0
    last, white = len(whiteners) - 1, np.empty(4)
    for n in range(1, len(errors)):
        if usable[n]:
            square = _square(errors[n], whiteners[min(n, last)], white)
            total += determinants[min(n, last)] + _heavy(square, dimension)
    return total


@kernel()
def whiten(errors: Array, usable: Mask, whiteners: Array, dimension: int) -> Array:
    """Prediction errors decorrelated, (T, 4), 0 where they do not count.

    They are scaled such that their squares add up to -2 log likelihood: about standard deviations where they are small,
    and less where they are large.
    """
    last = len(whiteners) - 1
    white = np.zeros((len(errors) - 1, 4))
    for n in range(1, len(errors)):
        if usable[n]:
            square = _square(errors[n], whiteners[min(n, last)], white[n - 1])
            white[n - 1] *= np.sqrt(_heavy(square, dimension) / max(square, 1e-12))
    return white


@kernel()
def robustify(errors: Array, usable: Mask, whiteners: Array, dimension: int) -> Array:
    """Prediction errors (T, 4) in their units, 0 where they do not count and less where they are large."""
    last, white = len(whiteners) - 1, np.empty(4)
    robust = np.zeros((len(errors) - 1, 4))
    for n in range(1, len(errors)):
        if usable[n]:
            square = _square(errors[n], whiteners[min(n, last)], white)
            robust[n - 1] = errors[n] * np.sqrt(_heavy(square, dimension) / max(square, 1e-12))
    return robust


def cost(errors: list[Array], usable: list[Mask], kalman: Filter) -> float:
    """-2 log likelihood of the prediction errors of several recordings, but for a constant."""
    of = kalman.whiteners, kalman.log_determinants, kalman.measured
    return float(sum(_cost(e, u, *of) for e, u in zip(errors, usable, strict=True)))


def fit_noise(
    linear: LinearTwin,
    noise: Noise,
    errors: list[Array],
    usable: list[Mask],
    limits: tuple[Noise, Noise],
    iterations: int,
) -> Noise:
    """The noise of the highest likelihood, from prediction errors made with the filter of `noise`.

    Args:
        linear: the twin about its balance.
        noise: with whose filter the errors were made; where the search begins.
        errors: (T + 1, 4) of each recording.
        usable: (T + 1,) of each recording.
        limits: least and largest levels.
        iterations: of L-BFGS, at most.
    """
    old = kalman_filter(linear, noise)
    low, high = (np.log(np.maximum(np.concatenate(limit), 1e-12)) for limit in limits)
    begin = np.log(np.concatenate([noise.sensors, noise.torques]))

    def objective(x: Array) -> float:
        try:
            kalman = kalman_filter(linear, _levels(x))
        except np.linalg.LinAlgError:  # levels too far apart for the covariance to stay definite
            return _IMPOSSIBLE
        moved = [_refilter(linear.F, linear.C, old.gains, kalman.gains, e) for e in errors]
        value = cost(moved, usable, kalman)
        return value if np.isfinite(value) else _IMPOSSIBLE

    bounds = [(max(x - 4.0, low[i]), max(min(x + 4.0, high[i]), low[i])) for i, x in enumerate(begin)]
    options = {"maxiter": iterations, "ftol": 1e-7}
    found = minimize(objective, begin, method="L-BFGS-B", bounds=bounds, options=options)
    return _levels(found.x if found.fun <= objective(begin) else begin)


def _levels(x: Array) -> Noise:
    levels = np.exp(x)
    return Noise(levels[:4], levels[4:])


@kernel()
def respond(F: Array, C: Array, gains: Array, B: Array, torques: Array) -> Array:
    """Prediction errors (T + 1, 4) that torques (T,) leave, of which the model does not know; B is (8,).

    With δ the true state less the predicted one, e_n = C δ_n and δ_{n+1} = F (δ_n - K_n e_n) + B τ_n.
    """
    errors = np.zeros((len(torques) + 1, 4))
    delta, moved = np.zeros(8), np.empty(8)
    last = len(gains) - 1
    for n in range(len(torques) + 1):
        K = gains[min(n, last)]
        for j in range(4):
            for i in range(8):
                errors[n, j] += C[j, i] * delta[i]
        if n == len(torques):
            break
        for i in range(8):
            moved[i] = delta[i]
            for j in range(4):
                moved[i] -= K[i, j] * errors[n, j]
        for i in range(8):
            delta[i] = B[i] * torques[n]
            for j in range(8):
                delta[i] += F[i, j] * moved[j]
    return errors
