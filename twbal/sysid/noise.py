r"""Noise of a predictor, its gain, and its likelihood.

About the balance the twin is x' = F x + w, y = C x + v with x = (θ, φ, θ̇, φ̇), followed by (θ, θ̇) of one control period
before and of two, from which a late IMU reads. v has the sensors' standard deviations; w is what white torques, one
between wheels and body and one on the wheels from outside, do within a control period. Gains are those of the Kalman
filter from the first instant on, where the state is what the first measurement tells.

Another gain K' in place of K changes the prediction errors as the linear twin says,

    e'_n = e_n - C δ_n,   δ_{n+1} = F (δ_n + K'_n e'_n - K_n e_n),   δ_0 = 0,

so noise is fitted without running the twin again.

What a model lacks is no white noise: it lasts. A *model discrepancy* may stand for it. It has five components: a torque
at the joints, one from outside on the wheels, and an error of the tilt, each a first-order Gauss-Markov process with a
time constant of its own (`DISCREPANCY_TIMES`); noise of the gyro that a filter has added up in the tilt; and what the
steps of an encoder make of a wheel that turns slowly, which lasts until the next step. Their levels are fitted with
those of the noise. It joins the state, x' = F x + D d + w with d' = exp(-T/τ) d, so that the filter follows what is
missing, and prediction errors stay white where a model is imperfect. (M. C. Kennedy, A. O'Hagan: Bayesian calibration
of computer models, Journal of the Royal Statistical Society B 63 (3), 2001, 425-464; here over time.) Levels of 0 leave
it out.

Prediction errors are taken to be of Student's t distribution, with the filter's covariance and as many dimensions as
channels were measured: a shove or a landing at the start then bears on the fit by no more than a few ordinary instants.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array
from twbal.planar.constants import Constants, constants
from twbal.planar.parameters import TwinParameters, linear_part
from twbal.planar.planar_plant import hold
from twbal.planar.sensing import imu_settled, sensor_slopes
from twbal.planar.twin_state import STRAIGHT, TwinState
from twbal.sysid.recording import Mask

_INSTANTS = 50  # after which gains have settled
_IMPOSSIBLE = 1e12
_LEAST_LEVEL = 1e-12
_SETTLED = 1e-4  # change of gains, whose rows are rad, rad/s and N·m for each rad or rad/s that was measured
_SHARED = 0.3  # of the other, where a search for white torques and a discrepancy of the same size begins
DISCREPANCY_TIMES = np.array([0.2, 0.2, 1.0])
"""Time constants of the model discrepancy: torque at the joints, torque from outside, tilt [s].

Friction of another form changes with the motion, within tenths of a second; a filter of the tilt and a gyro's bias are
slower.
"""
LASTING = 5
"""Components of the model discrepancy: see `Noise`."""
_IN_READINGS = ((10, 0), (11, 1), (12, 2))  # states of the discrepancy that are errors of a channel, and which
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
        discrepancy: (5,) standard deviations of the model discrepancy: torque at the joints, torque from outside
            [N·m], tilt [rad], noise of the gyro that the tilt has added up [rad/s], wheel angle [rad]; all 0 where
            there is none.
    """

    sensors: Array
    torques: Array
    discrepancy: Array = np.zeros(LASTING)

    @property
    def has_discrepancy(self) -> bool:
        """Whether the filter's state holds a model discrepancy."""
        return bool((self.discrepancy > 0.0).any())


class LinearTwin(NamedTuple):
    """The twin about its balance, over one control period; S is 8, or 13 with a model discrepancy.

    Attributes:
        F: (S, S).
        C: (4, S).
        B: (S, 2), what the two torques do within the period.
        decay: (5,) of the discrepancy over a control period; empty without one.
        period: control period [s].
    """

    F: Array
    C: Array
    B: Array
    decay: Array = np.zeros(0)
    period: float = 0.0

    def with_discrepancy(self, period: float, steps: float) -> "LinearTwin":
        """The same, with a model discrepancy in the state.

        Args:
            period: control period [s].
            steps: control periods for which the wheel angle shows one value before it steps to the next, in the mean.
        """
        states = 8 + LASTING
        F, C, B = np.zeros((states, states)), np.zeros((4, states)), np.zeros((states, 2))
        stays = np.exp(-1.0 / (steps - 1.0)) if steps > 1.0 else 0.0
        decay = np.concatenate([np.exp(-period / DISCREPANCY_TIMES), [0.0, stays]])
        F[:8, :8], F[:8, 8:10], F[8:, 8:] = self.F, self.B, np.diag(decay)
        C[:, :8] = self.C
        for state, channel in _IN_READINGS:
            C[channel, state] = 1.0
        B[:8] = self.B
        return LinearTwin(F, C, B, decay, period)

    @property
    def pushes(self) -> Array:
        """(2, 4), what a torque of the discrepancy adds to tilt, wheel, tilt rate and wheel speed in a period."""
        return np.ascontiguousarray(self.B[:4].T)


class Filter(NamedTuple):
    """A Kalman filter, instant by instant; the last row serves all later instants.

    Attributes:
        gains: (G, S, 4).
        whiteners: (G, 4, 4), W with W S Wᵀ = I, S the covariance of the prediction error.
        log_determinants: (G,), of S.
        measured: channels that a sensor measured: the dimension of the prediction errors.
        covariance: (4, 4) of what the corrected tilt, wheel angle, tilt rate and wheel speed are off by, once settled.
        pushes: as of `LinearTwin`.
        decay: as of `LinearTwin`.
    """

    gains: Array
    whiteners: Array
    log_determinants: Array
    measured: int
    covariance: Array
    pushes: Array
    decay: Array


def linearise_period(twin: TwinParameters, period: float) -> LinearTwin:
    """The linear twin, without the effects that are no part of a linear model."""
    smooth = linear_part(twin)
    k: Constants = constants(smooth, period / _STEPS)
    balance = np.array([-k.offset, 0.0, 0.0, 0.0])
    e = 1e-5

    def after(x: Array, torque: float, outside: float) -> Array:
        tilt, wheel, tilt_rate, wheel_speed = x.tolist()
        state = TwinState(tilt, wheel, tilt_rate, wheel_speed, 0.0, wheel, wheel_speed, 0.0, 0.0)
        pushed, imu = k._replace(pushed=outside / smooth.wheel_radius), imu_settled(k, state, 2 * _STEPS)
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
def _riccati(F: Array, C: Array, Q: Array, R: Array, P: Array, count: int, settled: float):  # type: ignore[no-untyped-def]
    """Gains, whiteners and log determinants of `count` instants, and the covariance after the last one.

    P is the covariance at the first instant, after it is read. Once no gain changes by more than `settled` from one
    instant to the next, all later ones are taken to be alike.
    """
    gains, whiteners = np.zeros((count, len(F), 4)), np.zeros((count, 4, 4))
    determinants = np.zeros(count)
    eye = np.eye(len(F))
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
        if np.abs(K - gains[n - 1]).max() < settled:
            gains[n:], whiteners[n:], determinants[n:] = K, whiteners[n], determinants[n]
            break
    return gains, whiteners, determinants, P


def kalman_filter(linear: LinearTwin, noise: Noise) -> Filter:
    """The Kalman filter of a linear twin with noise; nothing is corrected at the first instant."""
    R = np.diag(noise.sensors**2)
    Q = (linear.B * noise.torques**2) @ linear.B.T
    read = np.zeros((8, 4))  # what the first measurement says of the state
    read[:4] = np.linalg.inv([[1, 0, 0, 0], [0, 0, 1, 0], [-1, 1, 0, 0], [0, 0, -1, 1]])
    read[4] = read[6] = read[0]
    read[5] = read[7] = read[2]
    P, settled = 1.5 * read @ R @ read.T, 0.0
    if len(linear.decay):
        settled = _SETTLED
        P, Q = _with_discrepancy(P, Q, read, noise.discrepancy**2, linear)
    measured = int((noise.sensors < 0.5 * UNSENSED).sum())
    gains, whiteners, determinants, after = _riccati(linear.F, linear.C, Q, R, P, _INSTANTS, settled)
    return Filter(gains, whiteners, determinants, measured, after[:4, :4], linear.pushes, linear.decay)


def _with_discrepancy(P: Array, Q: Array, read: Array, variances: Array, linear: LinearTwin) -> tuple[Array, Array]:
    """Covariances (13, 13) of the first state and of the noise, with a stationary model discrepancy.

    Args:
        P: (8, 8) of the first state.
        Q: (13, 13) of the white torques.
        read: (8, 4) what the first measurement says of the state: as much as that is off, so is this.
        variances: (5,) of the discrepancy.
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


@kernel()
def _refilter(F: Array, C: Array, old: Array, new: Array, errors: Array) -> Array:
    """Prediction errors with other gains, by the linear twin."""
    changed = np.empty_like(errors)
    states = len(F)
    delta, moved = np.zeros(states), np.empty(states)
    last = len(old) - 1
    for n in range(len(errors)):
        K, L = old[min(n, last)], new[min(n, last)]
        for j in range(4):
            seen = 0.0
            for i in range(states):
                seen += C[j, i] * delta[i]
            changed[n, j] = errors[n, j] - seen
        for i in range(states):
            moved[i] = delta[i]
            for j in range(4):
                moved[i] += L[i, j] * changed[n, j] - K[i, j] * errors[n, j]
        for i in range(states):
            delta[i] = 0.0
            for j in range(states):
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


def error_variances(kalman: Filter) -> Array:
    """(4,) of the prediction errors of a filter that has settled."""
    L = np.linalg.inv(kalman.whiteners[-1])
    return np.asarray(np.diag(L @ L.T))


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
    afresh: bool = False,
) -> Noise:
    """The noise of the highest likelihood, from prediction errors made with the filter of `noise`.

    Args:
        linear: the twin about its balance.
        noise: with whose filter the errors were made; where the search begins.
        errors: (T + 1, 4) of each recording.
        usable: (T + 1,) of each recording.
        limits: least and largest levels.
        iterations: of L-BFGS, at most.
        afresh: whether a second search begins where white torques and a discrepancy share what is missing.
    """
    old = kalman_filter(linear, noise)
    begin = np.log(np.maximum(_fitted_levels(noise), _LEAST_LEVEL))
    low, high = (np.log(np.maximum(np.concatenate(limit), _LEAST_LEVEL))[: len(begin)] for limit in limits)
    begin = np.clip(begin, low, np.maximum(low, high))

    def objective(x: Array) -> float:
        try:
            kalman = kalman_filter(linear, _levels(x))
        except np.linalg.LinAlgError:  # levels too far apart for the covariance to stay definite
            return _IMPOSSIBLE
        moved = [_refilter(linear.F, linear.C, old.gains, kalman.gains, e) for e in errors]
        value = cost(moved, usable, kalman) + discrepancy_penalty(_levels(x), limits[1])
        return value if np.isfinite(value) else _IMPOSSIBLE

    found = [_descend(objective, start, low, high, iterations) for start in _noise_starts(noise, afresh)]
    levels, least = min(found, key=lambda pair: pair[1])
    return _levels(levels if least <= objective(begin) else begin)


def _descend(
    objective: Callable[[Array], float], begin: Array, low: Array, high: Array, iterations: int
) -> tuple[Array, float]:
    """The logarithms of levels where L-BFGS ends, and the objective there."""
    begin = np.clip(begin, low, np.maximum(low, high))
    bounds = [(max(x - 4.0, low[i]), max(min(x + 4.0, high[i]), low[i])) for i, x in enumerate(begin)]
    options = {"maxiter": iterations, "ftol": 1e-7}
    found = minimize(objective, begin, method="L-BFGS-B", bounds=bounds, options=options)
    return found.x, float(found.fun)


def _noise_starts(noise: Noise, afresh: bool) -> list[Array]:
    """Where searches for the noise begin: logarithms of its levels.

    White torques and those of a model discrepancy can do the same work, and one that has come to nothing stays there,
    as nothing then depends on it. So a second search begins with both of one size.
    """
    starts = [np.log(_fitted_levels(noise))]
    if afresh and noise.has_discrepancy:
        both = np.hypot(noise.torques, _SHARED * noise.discrepancy[:2])
        shared = noise._replace(torques=both, discrepancy=np.append(_SHARED * both, noise.discrepancy[2:]))
        starts.append(np.log(_fitted_levels(shared)))
    return starts


def _fitted_levels(noise: Noise) -> Array:
    """(6,) levels of noise, (11,) with those of a model discrepancy."""
    discrepancy = noise.discrepancy if noise.has_discrepancy else noise.discrepancy[:0]
    return np.concatenate([noise.sensors, noise.torques, discrepancy])


def _levels(x: Array) -> Noise:
    levels = np.exp(x)
    return Noise(levels[:4], levels[4:6], levels[6:] if len(levels) > 6 else np.zeros(LASTING))


def discrepancy_penalty(noise: Noise, largest: Noise) -> float:
    """-2 log prior of the levels of a model discrepancy, but for a constant: half-normal, `largest` at three sigmas."""
    if not noise.has_discrepancy:
        return 0.0
    return float((discrepancy_sigmas(noise, largest) ** 2).sum())


def discrepancy_sigmas(noise: Noise, largest: Noise) -> Array:
    """(5,) levels of a model discrepancy, in standard deviations of their prior: `largest` is three of them."""
    return 3.0 * noise.discrepancy / largest.discrepancy


@kernel()
def respond(F: Array, C: Array, gains: Array, B: Array, torques: Array) -> Array:
    """Prediction errors (T + 1, 4) that torques (T,) leave, of which the model does not know; B is (S,).

    With δ the true state less the predicted one, e_n = C δ_n and δ_{n+1} = F (δ_n - K_n e_n) + B τ_n.
    """
    errors = np.zeros((len(torques) + 1, 4))
    states = len(F)
    delta, moved = np.zeros(states), np.empty(states)
    last = len(gains) - 1
    for n in range(len(torques) + 1):
        K = gains[min(n, last)]
        for j in range(4):
            for i in range(states):
                errors[n, j] += C[j, i] * delta[i]
        if n == len(torques):
            break
        for i in range(states):
            moved[i] = delta[i]
            for j in range(4):
                moved[i] -= K[i, j] * errors[n, j]
        for i in range(states):
            delta[i] = B[i] * torques[n]
            for j in range(states):
                delta[i] += F[i, j] * moved[j]
    return errors
