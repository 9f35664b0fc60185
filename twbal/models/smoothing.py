"""The states behind noisy measurements: an extended Kalman smoother on f + g, its noise levels by maximum likelihood.

Why: a GP takes its inputs as exact. Sensor noise in them flattens what it learns (errors in variables): a small
spurious damping of the slow channels, which makes a policy that drifts off look stable. So g is learned from smoothed
states. The noise is split on the way into what the sensors add and what the dynamics add (where the model is wrong,
that too), so that the state's own uncertainty grows by the latter alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.optimize

from twbal.core.compiled import kernel
from twbal.core.episode import Episode
from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array
from twbal.core.threads import in_threads
from twbal.models.dataset import Transitions
from twbal.models.dynamics import DynamicsModel

_UNLIKELY = 1e12  # [nats]; stands for a likelihood that cannot be computed


class NoiseLevels(NamedTuple):
    """Of the measured channels.

    Attributes:
        sensors: (E,) variances that the sensors add to each measurement.
        process: (E,) variances that the dynamics add at each step.
    """

    sensors: Array
    process: Array


@dataclass(frozen=True)
class SmoothingSettings:
    """How states are smoothed.

    Attributes:
        rounds: how often g is learned from states smoothed on the g before.
        linearisations: how often, within a round, the smoother is linearised about its own result.
        iterations: of the likelihood's L-BFGS, at most.
        sensor_prior_sd: of log(sd / prior's sd) of each sensor; the prior is the data sheet's.
        process_prior_sd: of log(sd / last round's sd) of each channel's process noise.
        sensor_sd: by channel name, the data sheet's standard deviation of each sensor.
    """

    rounds: int
    linearisations: int
    iterations: int
    sensor_prior_sd: float
    process_prior_sd: float
    sensor_sd: dict[str, float]

    def sensor_variances(self, names: Sequence[str]) -> Array:
        """The data sheet's variance of each named channel, (E,).

        Raises:
            ConfigError: a channel has no entry.
        """
        missing = [name for name in names if name not in self.sensor_sd]
        if missing:
            raise ConfigError(
                f"model.smoothing.sensor_sd has no entry for {missing[0]}; it has: {', '.join(self.sensor_sd)}. "
                "Add the standard deviation that the sensor's data sheet gives."
            )
        return np.array([self.sensor_sd[name] for name in names]) ** 2


class _Linearised(NamedTuple):
    """An episode with its dynamics linearised about its measurements: x' = ahead_t + slope_t (x - measured_t).

    Attributes:
        measured: (T + 1, E).
        ahead: (T, E).
        slope: (T, E, E).
    """

    measured: Array
    ahead: Array
    slope: Array


def smooth(
    model: DynamicsModel, episodes: Sequence[Episode], levels: NoiseLevels, settings: SmoothingSettings
) -> tuple[NoiseLevels, list[Array]]:
    """Noise levels, and the smoothed states (T + 1, D) of each episode; past commands stay as they are.

    Args:
        levels: the priors' means: the data sheet's sensors, and the process noise of the round before.
    """
    measured = list(model.channels.measured)
    states = [np.array(episode.states) for episode in episodes]
    found = levels
    for _ in range(settings.linearisations):
        pieces = [_linearise(model, e, s, measured) for e, s in zip(episodes, states, strict=True)]
        found = _likeliest(pieces, found, levels, settings)
        for episode_states, piece in zip(states, pieces, strict=True):
            episode_states[:, measured] = _smoothed(piece, found)
    return found, states


def samples(episodes: Sequence[Episode], states: Sequence[Array], model: DynamicsModel) -> Transitions:
    """What f leaves of each smoothed step, as samples for g."""
    measured = list(model.channels.measured)
    rows = [np.column_stack([s[:-1], e.commands]) for e, s in zip(episodes, states, strict=True)]
    inputs = np.concatenate(rows)[:, list(model.channels.inputs)]
    changes = np.concatenate([np.diff(s[:, measured], axis=0) for s in states])
    return Transitions(inputs, changes - model.f.mean(inputs))


def _linearise(model: DynamicsModel, episode: Episode, states: Array, measured: list[int]) -> _Linearised:
    inputs = np.column_stack([states[:-1], episode.commands])
    ahead = states[:-1, measured] + model.change(inputs)
    slope = model.change_slope(inputs)[:, :, measured] + np.eye(len(measured))
    seen = np.ascontiguousarray(episode.states[:, measured])
    shift = np.einsum("tab,tb->ta", slope, seen[:-1] - states[:-1, measured])
    return _Linearised(seen, ahead + shift, np.ascontiguousarray(slope))


def _likeliest(
    pieces: Sequence[_Linearised], start: NoiseLevels, prior: NoiseLevels, settings: SmoothingSettings
) -> NoiseLevels:
    """Noise levels that maximise the likelihood of the innovations, with log-normal priors."""
    E = len(prior.sensors)
    centre = 0.5 * np.log(np.concatenate(prior))
    prior_sd = np.repeat([settings.sensor_prior_sd, settings.process_prior_sd], E)

    def negative(logs: Array) -> float:
        variances = np.exp(2.0 * np.clip(logs, -20.0, 10.0))
        likelihood = sum(_filter(*piece, variances[:E], variances[E:])[0] for piece in pieces)
        found = 0.5 * float(np.sum(((logs - centre) / prior_sd) ** 2)) - float(likelihood)
        return found if np.isfinite(found) else _UNLIKELY

    begin = 0.5 * np.log(np.concatenate(start))
    options = {"maxiter": settings.iterations, "workers": in_threads}  # for the finite differences
    found = scipy.optimize.minimize(negative, begin, method="L-BFGS-B", options=options)
    variances = np.exp(2.0 * found.x)
    return NoiseLevels(variances[:E], variances[E:])


@kernel()
def _filter(  # type: ignore[no-untyped-def]
    measured: Array, ahead: Array, slope: Array, sensors: Array, process: Array
):
    """Log likelihood of the innovations; filtered means and covariances; predicted means and covariances.

    By loops, as the matrices are of a few channels, and calls of LAPACK take longer than the work. With S = L Lᵀ, w =
    L⁻¹ of the innovation and G = L⁻¹ P, the innovation moves the mean by Gᵀ w and the covariance by -Gᵀ G.
    """
    steps, E = ahead.shape
    means, covariances = np.zeros((steps + 1, E)), np.zeros((steps + 1, E, E))
    ahead_means, ahead_covariances = np.zeros((steps + 1, E)), np.zeros((steps + 1, E, E))
    means[0], covariances[0] = measured[0], np.diag(sensors)
    carried, L, G, w = np.empty((E, E)), np.zeros((E, E)), np.empty((E, E)), np.empty(E)
    likelihood = 0.0
    for t in range(steps):
        A, C, P, predicted = slope[t], covariances[t], ahead_covariances[t + 1], ahead_means[t + 1]
        for a in range(E):
            predicted[a] = ahead[t, a]
            for b in range(E):
                predicted[a] += A[a, b] * (means[t, b] - measured[t, b])
                carried[a, b] = 0.0
                for c in range(E):
                    carried[a, b] += A[a, c] * C[c, b]
        for a in range(E):
            for b in range(a + 1):
                total = process[a] if a == b else 0.0
                for c in range(E):
                    total += carried[a, c] * A[b, c]
                P[a, b] = P[b, a] = total
        for a in range(E):
            for b in range(a + 1):
                left = P[a, b] + (sensors[a] if a == b else 0.0)
                for c in range(b):
                    left -= L[a, c] * L[b, c]
                L[a, b] = np.sqrt(left) if a == b else left / L[b, b]
        for a in range(E):
            w[a] = measured[t + 1, a] - predicted[a]
            for c in range(a):
                w[a] -= L[a, c] * w[c]
            w[a] /= L[a, a]
            likelihood -= 0.5 * w[a] ** 2 + np.log(L[a, a])
            for b in range(E):
                G[a, b] = P[a, b]
                for c in range(a):
                    G[a, b] -= L[a, c] * G[c, b]
                G[a, b] /= L[a, a]
        for a in range(E):
            means[t + 1, a] = predicted[a]
            for c in range(E):
                means[t + 1, a] += G[c, a] * w[c]
            for b in range(a + 1):
                left = P[a, b]
                for c in range(E):
                    left -= G[c, a] * G[c, b]
                covariances[t + 1, a, b] = covariances[t + 1, b, a] = left
    return likelihood, means, covariances, ahead_means, ahead_covariances


def compile_filter() -> None:
    """Run the filter once; its machine code stays in the cache folder."""
    _filter(np.zeros((2, 1)), np.zeros((1, 1)), np.ones((1, 1, 1)), np.ones(1), np.ones(1))


def _smoothed(piece: _Linearised, levels: NoiseLevels) -> Array:
    """Rauch-Tung-Striebel: means of the states given all measurements of the episode, (T + 1, E)."""
    _, means, covariances, ahead_means, ahead_covariances = _filter(*piece, levels.sensors, levels.process)
    for t in range(len(piece.ahead) - 1, -1, -1):
        gain = covariances[t] @ piece.slope[t].T @ np.linalg.inv(ahead_covariances[t + 1])
        means[t] += gain @ (means[t + 1] - ahead_means[t + 1])
    smoothed: Array = means
    return smoothed
