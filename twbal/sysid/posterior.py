"""What rollouts tell of the parameters of a robot: their posterior, by prediction error and a normal approximation.

All parameters are fitted at once from the prior that the robot's sheet gives (`planar.robot_distribution`), through the
Kalman predictor of `sysid.predictor`; the covariance is the inverse of the curvature there (Laplace). Nothing is named
or left out, as a diagnosis does: what rollouts do not tell stays as uncertain as it was before.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from twbal.core.episode import Episode
from twbal.core.errors import DataError
from twbal.core.gaussian import Array
from twbal.core.plant import Observation
from twbal.planar.parameters import twin_parameters
from twbal.planar.robot_distribution import RobotDistribution
from twbal.sysid.fit import Fit, refit, slopes_of
from twbal.sysid.model import Data, Free, Model
from twbal.sysid.noise import Noise
from twbal.sysid.recording import MEASURED, Recording

_SUBSTEPS = 10  # physics steps of a control period
_ROUNDS, _ITERATIONS, _NOISE_ITERATIONS = 4, 30, 20
_FIRST_SENSORS = (0.003, 0.02, 0.001, 0.05)  # rad, rad/s: where the search for the noise begins
_FIRST_DELAYS = (0.25, 1.0, 2.0, 2.75)  # control periods: fits with a delay that is far off end in optima of their own
_DELAY = "actuation_delay_delay"
_COLUMNS = [Observation._fields.index(name) for name in MEASURED]
_NUDGE = 2e-5  # of finite differences, in prior standard deviations: posterior ones can be a hundredth of these
_FALLEN = 0.6  # rad; what comes after is no balancing
_SHORTEST = 5  # control periods


def posterior(prior: RobotDistribution, episodes: Sequence[Episode]) -> RobotDistribution:
    """The distribution of a robot's parameters after episodes of it, in which it must not turn much: yaw is left out.

    Raises:
        DataError: no episode has a few control periods of a robot that stands.
    """
    recordings = [r for e in episodes if len(r := _recording(e, prior)) >= _SHORTEST]
    if not recordings:
        raise DataError(f"None of {len(episodes)} episodes has {_SHORTEST} control periods of a robot that stands.")
    data = Data(recordings, _SUBSTEPS)
    nominal = twin_parameters(prior.robot, {})
    begin = nominal._replace(**dict(zip(prior.fields, prior.mean.tolist(), strict=True)))
    # Noise that is fitted to a model far off explains what the model should: it begins small.
    noise = Noise(np.array(_FIRST_SENSORS), np.full(2, prior.small_torque))
    starts = [begin._replace(**{_DELAY: late * data.period}) for late in _FIRST_DELAYS]
    fits = [
        refit(data, Model(start, 0.0, noise), _free(prior), _ROUNDS, _ITERATIONS, _NOISE_ITERATIONS) for start in starts
    ]
    fit = min(fits, key=lambda found: found.cost)
    covariance = _covariance(data, fit, prior)
    return replace(prior, mean=fit.values, covariance=covariance, sensor_sd=fit.model.noise.sensors)


def _recording(episode: Episode, robots: RobotDistribution) -> Recording:
    seen = episode.observations
    fallen = np.flatnonzero(np.abs(seen[:, _COLUMNS[0]]) > _FALLEN)
    end = int(fallen[0]) if len(fallen) else len(seen)
    return Recording(
        "",
        episode.control_period,
        robots.possible(episode.commands[: max(end - 1, 0)]),
        np.ascontiguousarray(seen[:end, _COLUMNS]),
        np.zeros(end),
        np.ones(end, dtype=bool),
        np.ones(4, dtype=bool),
    )


def _free(prior: RobotDistribution) -> list[Free]:
    sds = np.sqrt(np.diag(prior.covariance))
    return [
        Free(field, float(low), float(high), float(mean), float(sd), float(_NUDGE * sd))
        for field, low, high, mean, sd in zip(prior.fields, prior.low, prior.high, prior.mean, sds, strict=True)
    ]


def _covariance(data: Data, fit: Fit, prior: RobotDistribution) -> Array:
    J = slopes_of(data, fit)
    found: Array = np.linalg.inv(J.T @ J + np.linalg.inv(prior.covariance))
    # Within a physics step of the model the delay is not smooth, so that its curvature there tells nothing.
    late = prior.fields.index(_DELAY)
    found[late, late] += (data.period / data.substeps) ** 2 / 12.0
    return 0.5 * (found + found.T)
