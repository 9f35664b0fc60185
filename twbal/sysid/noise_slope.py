r"""Slope of the likelihood by the levels of noise, in reverse mode.

It costs about two evaluations of the likelihood, whatever the number of levels. The likelihood of `noise_fit` depends
on a level by the filter alone. Its derivatives by the gains K_n and by the covariances S_n of the errors follow from
one pass backward over the recordings (λ_n is the derivative by δ_n),

    μ = Fᵀ λ_{n+1},   ∂J/∂K'_n = μ e'_nᵀ,   λ_n = μ - Cᵀ (∂J/∂e'_n + K'_nᵀ μ),

and those by the covariances of the noise from one backward over the Riccati equation. There the derivative of the
corrected covariance by the gain vanishes, as the Kalman filter's gain makes it smallest. (A. Griewank, A. Walther:
Evaluating Derivatives, 2nd ed., SIAM 2008, chapter 3.)
"""

import numpy as np

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array, Mask
from twbal.sysid.kalman import Covariances, LinearPlanarModel, Solution, covariances
from twbal.sysid.likelihood import TAIL
from twbal.sysid.noise import LASTING, NoiseModel


def slope_of_levels(
    linear: LinearPlanarModel,
    units: Covariances,
    noise: NoiseModel,
    solved: Solution,
    errors: list[Array],
    usable: list[Mask],
    measured: int,
) -> Array:
    """Derivatives of `likelihood.cost` by the logarithms of the levels, (12,), with a model discrepancy.

    Args:
        linear: the planar model about its balance.
        units: of the same, as of `of_one_level_each`.
        noise: levels at which the slope is.
        solved: the Riccati equation with that noise.
        errors: (T + 1, 4) of each recording, as the filter of that noise makes them.
        usable: (T + 1,) of each recording.
        measured: channels that a sensor measured.
    """
    of, gains, whiteners, _, after, last = solved
    by_gains, by_errors = np.zeros_like(gains), np.zeros_like(whiteners)
    for each, counts in zip(errors, usable, strict=True):
        _through_errors(linear.F, linear.C, gains, whiteners, each, counts, measured, by_gains, by_errors)
    by_gains[last], by_errors[last] = by_gains[last:].sum(axis=0), by_errors[last:].sum(axis=0)
    found = _through_riccati(linear.F, linear.C, of.process, of.sensors, after, gains, last, by_gains, by_errors)
    levels = np.concatenate([noise.sensors, noise.torques, noise.discrepancy])
    by_squares = sum(np.einsum("ij,lij->l", by, unit) for by, unit in zip(found, units, strict=True))
    return np.asarray(2.0 * levels**2 * by_squares)


def of_one_level_each(linear: LinearPlanarModel) -> Covariances:
    """The covariances that each level makes where it is 1 and the others are 0, (12, ...) each."""
    units = np.eye(6 + LASTING)
    each = [covariances(linear, NoiseModel(unit[:4], unit[4:6], unit[6:])) for unit in units]
    return Covariances(*(np.array(part) for part in zip(*each, strict=True)))


@kernel()
def _through_errors(
    F: Array,
    C: Array,
    gains: Array,
    whiteners: Array,
    errors: Array,
    usable: Mask,
    dimension: int,
    by_gains: Array,
    by_errors: Array,
) -> None:
    """Add to (G, S, 4) and (G, 4, 4) the derivatives by gains and by covariances of the errors of a recording."""
    states, last = len(F), len(gains) - 1
    precisions = np.empty_like(whiteners)
    for n in range(last + 1):
        precisions[n] = whiteners[n].T @ whiteners[n]
    later, mu, by_error, v = np.zeros(states), np.empty(states), np.empty(4), np.empty(4)
    for n in range(len(errors) - 1, 0, -1):
        at = min(n, last)
        mu[:] = 0.0
        for j in range(states):
            for i in range(states):
                mu[i] += F[j, i] * later[j]
        by_error[:] = 0.0
        if usable[n]:
            square = 0.0
            for i in range(4):
                v[i] = 0.0
                for j in range(4):
                    v[i] += precisions[at, i, j] * errors[n, j]
                square += v[i] * errors[n, i]
            weight = (TAIL + dimension) / (TAIL - 2.0 + square)
            for i in range(4):
                by_error[i] = 2.0 * weight * v[i]
                for j in range(4):
                    by_errors[at, i, j] += precisions[at, i, j] - weight * v[i] * v[j]
        for i in range(states):
            for j in range(4):
                by_gains[at, i, j] += mu[i] * errors[n, j]
                by_error[j] += gains[at, i, j] * mu[i]
        for i in range(states):
            later[i] = mu[i]
        for j in range(4):
            for i in range(states):
                later[i] -= C[j, i] * by_error[j]


@kernel()
def _through_riccati(  # type: ignore[no-untyped-def]
    F: Array, C: Array, Q: Array, R: Array, after: Array, gains: Array, last: int, by_gains: Array, by_errors: Array
):
    """The derivatives by the covariances of the first state, of the process and of the sensors."""
    by_state, by_process, by_sensors = np.zeros_like(F), np.zeros_like(F), np.zeros_like(R)
    eye = np.eye(len(F))
    for n in range(last, 0, -1):
        K = gains[n]
        left = eye - K @ C
        ahead = F @ after[n - 1] @ F.T + Q
        G = by_gains[n] @ np.linalg.inv(C @ ahead @ C.T + R)
        by_error = by_errors[n] - 0.5 * (K.T @ G + G.T @ K)
        by_sensors += K.T @ by_state @ K + by_error
        by_ahead = left.T @ by_state @ left + 0.5 * (G @ C + C.T @ G.T) + C.T @ by_error @ C
        by_process += by_ahead
        by_state = F.T @ by_ahead @ F
    return by_state, by_process, by_sensors
