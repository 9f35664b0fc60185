r"""Noise of the highest likelihood.

Another gain K' in place of K changes the prediction errors as the linear twin says,

    e'_n = e_n - C δ_n,   δ_{n+1} = F (δ_n + K'_n e'_n - K_n e_n),   δ_0 = 0,

so noise is fitted without running the twin again.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import minimize

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array, Mask
from twbal.sysid.kalman import Filter, LinearTwin, kalman_filter
from twbal.sysid.likelihood import cost
from twbal.sysid.noise import LASTING, Noise, discrepancy_penalty, discrepancy_sigmas
from twbal.sysid.noise_slope import of_one_level_each, slope_of_levels

_IMPOSSIBLE = 1e12
_LEAST_LEVEL = 1e-12
_SHARED = 0.3  # of the other, where a search for white torques and a discrepancy of the same size begins


@kernel()
def refilter(F: Array, C: Array, old: Array, new: Array, errors: Array) -> Array:
    """Prediction errors (T + 1, 4) with other gains, by the linear twin."""
    changed = np.empty_like(errors)
    states = len(F)
    ahead, shown = F.T.copy(), C.T.copy()  # so that the compiler makes vectors of the inner loops
    delta, moved, seen = np.zeros(states), np.empty(states), np.empty(4)
    last = len(old) - 1
    for n in range(len(errors)):
        K, L = old[min(n, last)], new[min(n, last)]
        seen[:] = 0.0
        for i in range(states):
            for j in range(4):
                seen[j] += shown[i, j] * delta[i]
        for j in range(4):
            changed[n, j] = errors[n, j] - seen[j]
        for i in range(states):
            moved[i] = delta[i]
            for j in range(4):
                moved[i] += L[i, j] * changed[n, j] - K[i, j] * errors[n, j]
        delta[:] = 0.0
        for j in range(states):
            for i in range(states):
                delta[i] += ahead[j, i] * moved[j]
    return changed


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
    units = of_one_level_each(linear)
    begin = np.log(np.maximum(_fitted_levels(noise), _LEAST_LEVEL))
    low, high = (np.log(np.maximum(np.concatenate(limit), _LEAST_LEVEL))[: len(begin)] for limit in limits)
    begin = np.clip(begin, low, np.maximum(low, high))

    def filtered(x: Array) -> tuple[Filter, list[Array]]:
        kalman = kalman_filter(linear, _levels(x))
        return kalman, [refilter(linear.F, linear.C, old.gains, kalman.gains, e) for e in errors]

    def value(x: Array, kalman: Filter, moved: list[Array]) -> float:
        found = cost(moved, usable, kalman) + discrepancy_penalty(_levels(x), limits[1])
        return found if np.isfinite(found) else _IMPOSSIBLE

    def objective(x: Array) -> float:
        try:
            return value(x, *filtered(x))
        except np.linalg.LinAlgError:  # levels too far apart for the covariance to stay definite
            return _IMPOSSIBLE

    def objective_and_slope(x: Array) -> tuple[float, Array]:
        try:
            kalman, moved = filtered(x)
            found, levels = value(x, kalman, moved), _levels(x)
            slope = slope_of_levels(linear, units, levels, moved, usable, kalman.measured)
        except np.linalg.LinAlgError:
            return _IMPOSSIBLE, np.zeros_like(x)
        slope[6:] += 2.0 * discrepancy_sigmas(levels, limits[1]) ** 2
        return (found, slope) if np.isfinite(slope).all() else (_IMPOSSIBLE, np.zeros_like(x))

    # Without a discrepancy there are 6 levels instead of 12 and the state is small: finite differences serve.
    function, has_slope = (objective_and_slope, True) if noise.has_discrepancy else (objective, None)
    found = [_descend(function, has_slope, start, low, high, iterations) for start in _noise_starts(noise, afresh)]
    levels, least = min(found, key=lambda pair: pair[1])
    return _levels(levels if least <= objective(begin) else begin)


def _descend(
    function: Callable[[Array], Any], has_slope: bool | None, begin: Array, low: Array, high: Array, iterations: int
) -> tuple[Array, float]:
    """The logarithms of levels where L-BFGS ends, and the objective there; None: the function does not give a slope."""
    begin = np.clip(begin, low, np.maximum(low, high))
    bounds = [(max(x - 4.0, low[i]), max(min(x + 4.0, high[i]), low[i])) for i, x in enumerate(begin)]
    options = {"maxiter": iterations, "ftol": 1e-7}
    found = minimize(function, begin, jac=has_slope, method="L-BFGS-B", bounds=bounds, options=options)
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
