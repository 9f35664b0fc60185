r"""The rate of a channel that was measured without it, with its uncertainty: a Kalman smoother, not differences.

The channel's acceleration is taken to wander: x = (value, rate, acceleration), x' = F x + w, y = value + v, with white
jerk of density q and noise of standard deviation r. Both levels are those of the highest likelihood. In the settled
state all gains are constant, so that a recording is gone through once forward and once backward (Rauch, Tung and
Striebel 1965).
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_discrete_are, solve_discrete_lyapunov
from scipy.optimize import minimize_scalar

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array

_LOOKED_AT = 20_000  # samples from which the levels are found
_RATIOS, _TRIED = (-10.0, 4.0), 29  # decimal logarithm of q dt⁵ / r² that is looked through, and in how many steps


class Smoothed(NamedTuple):
    """What a smoother makes of a channel.

    Attributes:
        value: (n,).
        rate: (n,) a second.
        rate_sd: standard deviation of `rate`, by the smoother's own account.
        noise_sd: r, of the measurement.
    """

    value: Array
    rate: Array
    rate_sd: float
    noise_sd: float


def smooth(measured: Array, period: float) -> Smoothed:
    """Value and rate of a channel.

    Args:
        measured: (n,), n at least 4.
        period: between samples [s].
    """
    part = np.ascontiguousarray(measured[:_LOOKED_AT])

    def misfit(log_ratio: float) -> float:
        """-2 log likelihood a sample, at the best r, but for a constant."""
        errors = _forward(part, _settled(10.0**log_ratio)[0])[1][3:]
        return float(np.log(max(float(np.mean(errors**2)), 1e-300)))

    grid = np.linspace(*_RATIOS, _TRIED)
    best = float(grid[int(np.argmin([misfit(float(x)) for x in grid]))])
    log_ratio = float(minimize_scalar(misfit, bounds=(best - 0.5, best + 0.5), method="bounded").x)
    gain, covariance, spread = _settled(10.0**log_ratio)
    _, errors = _forward(part, gain)
    r = float(np.sqrt(np.mean(errors[3:] ** 2) / spread))
    states, _ = _forward(np.ascontiguousarray(measured), gain)
    back, after = _smoother(covariance)
    _backward(states, back)
    return Smoothed(states[:, 0], states[:, 1] / period, r * float(np.sqrt(after[1, 1])) / period, r)


_F = np.array([[1.0, 1.0, 0.5], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])  # in units of the period
_Q = np.array([[1 / 20, 1 / 8, 1 / 6], [1 / 8, 1 / 3, 1 / 2], [1 / 6, 1 / 2, 1.0]])  # of white jerk
_C = np.array([[1.0, 0.0, 0.0]])


@lru_cache(maxsize=256)
def _settled(ratio: float) -> tuple[Array, Array, float]:
    """Gain (3,), covariance before a measurement (3, 3) and variance of the prediction error, for r = 1."""
    P = solve_discrete_are(_F.T, _C.T, ratio * _Q, np.eye(1))
    spread = float(P[0, 0] + 1.0)
    return P[:, 0] / spread, P, spread


def _smoother(before: Array) -> tuple[Array, Array]:
    """Gain of the backward pass (3, 3) and the covariance after it, for r = 1."""
    after = before - np.outer(before[:, 0], before[0]) / (before[0, 0] + 1.0)
    G = np.linalg.solve(before, _F @ after).T
    constant = after - G @ before @ G.T
    return G, np.asarray(solve_discrete_lyapunov(G, 0.5 * (constant + constant.T)))


@kernel()
def _forward(measured: Array, gain: Array) -> tuple[Array, Array]:
    """States after each measurement (n, 3), rates in units of the period, and prediction errors (n,)."""
    states, errors = np.empty((len(measured), 3)), np.zeros(len(measured))
    x, v, a = measured[0], 0.5 * (measured[2] - measured[0]), 0.0
    for n in range(len(measured)):
        if n > 0:
            x, v = x + v + 0.5 * a, v + a
        errors[n] = measured[n] - x
        x, v, a = x + gain[0] * errors[n], v + gain[1] * errors[n], a + gain[2] * errors[n]
        states[n, 0], states[n, 1], states[n, 2] = x, v, a
    return states, errors


@kernel()
def _backward(states: Array, G: Array) -> None:
    """Turn filtered states into smoothed ones, in place."""
    for n in range(len(states) - 2, -1, -1):
        x, v, a = states[n, 0], states[n, 1], states[n, 2]
        dx = states[n + 1, 0] - (x + v + 0.5 * a)
        dv = states[n + 1, 1] - (v + a)
        da = states[n + 1, 2] - a
        states[n, 0] = x + G[0, 0] * dx + G[0, 1] * dv + G[0, 2] * da
        states[n, 1] = v + G[1, 0] * dx + G[1, 1] * dv + G[1, 2] * da
        states[n, 2] = a + G[2, 0] * dx + G[2, 1] * dv + G[2, 2] * da
