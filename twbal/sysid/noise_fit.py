r"""Noise of the highest likelihood.

Another gain K' in place of K changes the prediction errors as the linear model says,

    e'_n = e_n - C δ_n,   δ_{n+1} = F (δ_n + K'_n e'_n - K_n e_n),   δ_0 = 0,

so noise is fitted without running the planar model again.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import minimize

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array, Mask
from twbal.sysid.kalman import Covariances, Filter, LinearPlanarModel, kalman_filter, solution
from twbal.sysid.likelihood import cost
from twbal.sysid.noise import LASTING, UNSENSED, NoiseModel, discrepancy_penalty, discrepancy_sigmas
from twbal.sysid.noise_slope import of_one_level_each, slope_of_levels

_IMPOSSIBLE = 1e12
_LEAST_LEVEL = 1e-12
_CLIPPED = 6.0  # medians of the sizes of errors, beyond which one counts as so many: four standard deviations
_SWINGS = 0.2  # of the errors' variance, which their autocovariance at lag 1 is below 0
_LOUDER = 4.0  # times the variance that a sensor's noise has already
_CALM = 0.1  # of the torques, where a search for louder sensors begins
_SHARED = 0.3  # of the other, where a search for white torques and a discrepancy of the same size begins


@kernel()
def refilter(F: Array, C: Array, old: Array, new: Array, errors: Array) -> Array:
    """Prediction errors (T + 1, 4) with other gains, by the linear model."""
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
    linear: LinearPlanarModel,
    noise: NoiseModel,
    errors: list[Array],
    usable: list[Mask],
    limits: tuple[NoiseModel, NoiseModel],
    iterations: int,
    afresh: bool = False,
) -> NoiseModel:
    """The noise of the highest likelihood, from prediction errors made with the filter of `noise`.

    Args:
        linear: the planar model about its balance.
        noise: with whose filter the errors were made; where the search begins.
        errors: (T + 1, 4) of each recording.
        usable: (T + 1,) of each recording.
        limits: least and largest levels.
        iterations: of L-BFGS, at most.
        afresh: whether a second search begins where white torques and a discrepancy share what is missing.
    """
    objective = _Objective(linear, kalman_filter(linear, noise).gains, errors, usable, limits[1])
    begin = np.log(np.maximum(_fitted_levels(noise), _LEAST_LEVEL))
    low, high = (np.log(np.maximum(np.concatenate(limit), _LEAST_LEVEL))[: len(begin)] for limit in limits)
    begin = np.clip(begin, low, np.maximum(low, high))
    starts = _noise_starts(noise, afresh)
    if (summed := summed_gyro_noise(noise, linear.summed)) is not None:
        starts.append(np.log(np.maximum(_fitted_levels(summed), _LEAST_LEVEL)))
    if noise.has_discrepancy and (louder := louder_sensors(noise, errors, usable)) is not None:
        starts.append(np.log(_fitted_levels(louder)))
    found = [_descend(objective, start, low, high, iterations) for start in starts]
    levels, least = min(found, key=lambda pair: pair[1])
    return _levels(levels if least <= objective.value(begin) else begin)


@dataclass(frozen=True, eq=False)
class _Objective:
    """-2 log posterior of the logarithms of levels, (6,) or (12,) with a model discrepancy, but for a constant.

    Attributes:
        linear: the planar model about its balance.
        gains: (G, S, 4), of the filter that made the errors.
        errors: (T + 1, 4) of each recording.
        usable: (T + 1,) of each recording.
        largest: levels, by which those of a discrepancy have a prior.
    """

    linear: LinearPlanarModel
    gains: Array
    errors: list[Array]
    usable: list[Mask]
    largest: NoiseModel

    def value(self, x: Array) -> float:
        """It, at `x`."""
        try:
            kalman = kalman_filter(self.linear, _levels(x))
            return self._of(_levels(x), kalman, self._moved(kalman))
        except np.linalg.LinAlgError:  # levels too far apart for the covariance to stay definite
            return _IMPOSSIBLE

    def with_slope(self, x: Array) -> tuple[float, Array]:
        """It and its slope, with a model discrepancy."""
        levels, nowhere = _levels(x), (_IMPOSSIBLE, np.zeros_like(x))
        try:
            solved = solution(self.linear, levels)
            kalman = solved.filter(self.linear, levels)
            moved = self._moved(kalman)
            slope = slope_of_levels(self.linear, self._units, levels, solved, moved, self.usable, kalman.measured)
        except np.linalg.LinAlgError:
            return nowhere
        slope[6:] += 2.0 * discrepancy_sigmas(levels, self.largest) ** 2
        value = self._of(levels, kalman, moved)
        return (value, slope) if value < _IMPOSSIBLE and np.isfinite(slope).all() else nowhere

    def _moved(self, kalman: Filter) -> list[Array]:
        """The errors that another filter would make."""
        F, C = self.linear.F, self.linear.C
        return [refilter(F, C, self.gains, kalman.gains, errors) for errors in self.errors]

    def _of(self, levels: NoiseModel, kalman: Filter, moved: list[Array]) -> float:
        found = cost(moved, self.usable, kalman) + discrepancy_penalty(levels, self.largest)
        return found if np.isfinite(found) else _IMPOSSIBLE

    @cached_property
    def _units(self) -> Covariances:
        return of_one_level_each(self.linear)


def _descend(objective: _Objective, begin: Array, low: Array, high: Array, iterations: int) -> tuple[Array, float]:
    """The logarithms of levels where L-BFGS ends, and the objective there.

    Without a model discrepancy there are half as many levels and the state is small: finite differences serve.
    """
    has_slope = len(begin) > 6
    function = objective.with_slope if has_slope else objective.value
    begin = np.clip(begin, low, np.maximum(low, high))
    bounds = [(max(x - 4.0, low[i]), max(min(x + 4.0, high[i]), low[i])) for i, x in enumerate(begin)]
    options = {"maxiter": iterations, "ftol": 1e-7}
    found = minimize(function, begin, jac=has_slope or None, method="L-BFGS-B", bounds=bounds, options=options)
    return found.x, float(found.fun)


def _noise_starts(noise: NoiseModel, afresh: bool) -> list[Array]:
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


def summed_gyro_noise(noise: NoiseModel, summed: float) -> NoiseModel | None:
    """Noise of the gyro that the tilt has added up, in the place of noise that it has not; None where it is so.

    Where the tilt comes from a filter, all that the gyro reads is in it, with its noise. The two kinds of noise do the
    same to the gyro's reading, so the likelihood has an optimum for each, and as it depends on the logarithm of a level
    that is nearly nothing hardly at all, a search that begins with the one does not find the other.

    Args:
        noise: levels so far.
        summed: time over which a filter adds up the gyro in a period [s]; 0 where the tilt comes from none.
    """
    own, added = noise.sensors[1], noise.discrepancy[3]
    if not (noise.has_discrepancy and summed > 0.0 and added < own < 0.5 * UNSENSED):
        return None
    sensors, discrepancy = noise.sensors.copy(), noise.discrepancy.copy()
    sensors[1], discrepancy[3] = _SHARED * own, own
    return noise._replace(sensors=sensors, discrepancy=discrepancy)


def louder_sensors(noise: NoiseModel, errors: Sequence[Array], usable: Sequence[Mask]) -> NoiseModel | None:
    """Noise in which sensors are as loud as the errors of a filter tell, and torques calm; None where they are so.

    A filter that takes the noise of a sensor for motion finds that motion gone at the next instant. Its errors swing
    back: their autocovariance at lag 1 is minus the variance of that noise. There the likelihood has an optimum of its
    own, with loud torques and a sensor without noise, which a search that begins beside it does not leave. (R. K.
    Mehra: On the identification of variances and adaptive Kalman filtering, IEEE Transactions on Automatic Control 15
    (2), 1970, 175-184.)

    Args:
        noise: with whose filter the errors were made.
        errors: (T + 1, 4) of each recording.
        usable: (T + 1,) of each recording.
    """
    sensors = noise.sensors.copy()
    for i in np.flatnonzero(noise.sensors < 0.5 * UNSENSED):
        values = [each[:, i] for each in errors]
        most = _CLIPPED * np.median(np.abs(np.concatenate([v[u] for v, u in zip(values, usable, strict=True)])))
        parts = [(np.clip(v, -most, most), u[1:] & u[:-1]) for v, u in zip(values, usable, strict=True)]
        now, before = (np.concatenate([v[begin : len(v) - 1 + begin][u] for v, u in parts]) for begin in (1, 0))
        swing, variance = -float(now @ before) / max(len(now), 1), float(now @ now) / max(len(now), 1)
        if swing > max(_SWINGS * variance, _LOUDER * float(noise.sensors[i]) ** 2):
            sensors[i] = np.sqrt(swing)
    if np.array_equal(sensors, noise.sensors):
        return None
    return noise._replace(sensors=sensors, torques=_CALM * noise.torques)


def _fitted_levels(noise: NoiseModel) -> Array:
    """(6,) levels of noise, (12,) with those of a model discrepancy."""
    discrepancy = noise.discrepancy if noise.has_discrepancy else noise.discrepancy[:0]
    return np.concatenate([noise.sensors, noise.torques, discrepancy])


def _levels(x: Array) -> NoiseModel:
    levels = np.exp(x)
    return NoiseModel(levels[:4], levels[4:6], levels[6:] if len(levels) > 6 else np.zeros(LASTING))
