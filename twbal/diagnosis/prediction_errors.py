"""Errors of one simulation's open-loop predictions on one log, and what the sensors' noise alone would make of them.

The start of a prediction is what the Kalman filter of this very simulation makes of the measurements up to that
instant. The filters of all simulations weigh measurements alike: by the sensors' noise, which the log alone tells
(`sysid.sensor_noise`), and by a torque that stands for what a model gets wrong, a share of the commands. Neither
depends on a simulation.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_lyapunov

from twbal.core.gaussian import Array, Mask
from twbal.planar.parameters import PlanarParameters
from twbal.sysid.kalman import Filter, LinearPlanarModel, linearise_period
from twbal.sysid.model import Data, Model
from twbal.sysid.open_loop import OpenLoop, predict_open_loop

Indices = NDArray[np.int_]

_FARTHEST = 1e6  # rad, rad/s; a prediction that is off by more has diverged
_DRAWS = 4  # starts that are off by what noise makes of them, for each start


class PredictionErrors(NamedTuple):
    """Errors of n predictions over H horizons.

    Attributes:
        errors: (n, H, 4) measured less predicted, in the order of `MEASURED`; not finite where a prediction diverges.
        noise_floor: (H, 4) root mean square error by noise alone, were the simulation right; NaN where there is none.
        fell: (n, H), whether the simulated body came to the tilt limit.
    """

    errors: Array
    noise_floor: Array
    fell: Mask


class PredictionWindows(NamedTuple):
    """From where and how far predictions go.

    Attributes:
        starts: (n,) instants.
        horizons: (H,) [control periods].
        limit: tilt at which the body lies and stays [rad].
    """

    starts: Indices
    horizons: Indices
    limit: float


def prediction_errors(data: Data, model: Model, plan: PredictionWindows, rng: np.random.Generator) -> PredictionErrors:
    """Errors of a model's predictions on a recording.

    Args:
        data: one recording.
        model: of the simulation, with the noise that all share.
        plan: where predictions start.
        rng: draws what starts are off by, for the noise floor.
    """
    (recording,) = data.recordings
    shape = (len(plan.starts), len(plan.horizons), 4)
    try:
        kalman, linear = data.filter(model), linearise_period(model.planar, data.period)
        errors, states = data.predictions(model, kalman)[0]
        states = recording.even_states(states)
        sensors = _bounded(model.noise.sensors, errors[recording.usable])
        sds = _spread(linear, kalman, sensors)
    except (np.linalg.LinAlgError, ValueError):  # a simulation without a filter: its numbers are beyond floats
        return PredictionErrors(np.full(shape, np.nan), np.full(shape[1:], np.nan), np.zeros(shape[:2], bool))
    right = _predicted(data, model.planar_for(0), states, plan, np.zeros((shape[0], 8)))
    seen = recording.measured[plan.starts[:, None] + plan.horizons]
    errors = seen - right.readings[:, plan.horizons - 1]
    errors[np.abs(errors) > _FARTHEST] = np.nan
    variance = np.zeros(shape[1:])
    for _ in range(_DRAWS):
        off = rng.standard_normal((shape[0], 8)) @ sds.T
        moved = _predicted(data, model.planar_for(0), states, plan, off)
        shift = (moved.readings - right.readings)[:, plan.horizons - 1]
        shift[np.abs(shift) > _FARTHEST] = np.nan
        variance += np.mean(shift**2, axis=0) / _DRAWS
    floor = np.sqrt(variance + sensors**2)
    return PredictionErrors(errors, np.asarray(floor), right.fell[:, None] <= plan.horizons)


def _predicted(data: Data, planar: PlanarParameters, states: Array, plan: PredictionWindows, off: Array) -> OpenLoop:
    recording, steps = data.recordings[0], int(plan.horizons.max())
    return predict_open_loop(planar, recording, data.substeps, states, plan.starts, off, steps, plan.limit)


def _bounded(sensors: Array, errors: Array) -> Array:
    """The sensors' noise (4,), which is no more than the errors (T, 4) of predictions of the next instant.

    The log alone tells it from above. Were the simulation right, these errors would be that noise and little else.
    """
    rms = np.sqrt(np.mean(errors**2, axis=0))
    return np.where((rms > 0.0) & (rms < sensors), rms, sensors)


def _spread(linear: LinearPlanarModel, kalman: Filter, sensors: Array) -> Array:
    """A root (8, 8) of the covariance of what the settled filter's state is off by, where only sensors have noise.

    The filter reckons with torques that there are not; with its gain K and R of the sensors the error is that of
    e⁺ = (I - K C) F e⁺ - K v, so that P = A P Aᵀ + K R Kᵀ, A = (I - K C) F.
    """
    K = kalman.gains[-1]
    A = (np.eye(8) - K @ linear.C) @ linear.F
    P = solve_discrete_lyapunov(A, (K * sensors**2) @ K.T)
    values, vectors = np.linalg.eigh(0.5 * (P + P.T))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))
