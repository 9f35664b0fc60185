r"""The sensors' noise by a recording alone, whatever model is held against it.

An angle whose rate is measured tells it beside that rate: z_n = y_{n+1} - y_n - dt (ẏ_n + ẏ_{n+1}) / 2 has the angle's
noise twice, once with each sign, so that its autocovariances are γ_0 - 2 γ_1 = 4 σ², whatever the motion.

For all else there are two estimators, each of which takes some of the motion, or of the noise of other sensors, for
noise; so the smaller one counts, and it errs upwards if at all:

- the innovations of a linear autoregression on the past of all sensors and commands (Ljung 1999, ch. 4.2), which errs
  where the robot is not linear;
- the smoother that works out rates of unmeasured channels, which errs where commands change at every instant.
"""

import numpy as np
from numpy.typing import NDArray

from twbal.core.gaussian import Array
from twbal.io.importers.smoother import smooth
from twbal.sysid.model import Data
from twbal.sysid.noise import UNSENSED
from twbal.sysid.recording import Recording

_LOOKED_AT = 4000  # instants
_MEMORY = 10  # control periods of the past in the autoregression
_FEWEST = 3  # instants for each of its coefficients
_RATE_OF = {0: 1, 2: 3}  # channels of `MEASURED`


def sensor_noise(recording: Recording) -> Array:
    """Standard deviations of the sensors, (4,) in the order of `MEASURED`; `UNSENSED` of what was not measured."""
    part = recording.part(0, min(len(recording), _LOOKED_AT))
    sensed = np.flatnonzero(part.sensed)
    found = np.full(4, UNSENSED)
    found[sensed] = _innovations(part, sensed)
    for i in sensed:
        rate = _RATE_OF.get(int(i))
        if rate is not None and rate in sensed:
            found[i] = _beside_its_rate(part.measured[:, i], part.measured[:, rate], part.period)
        else:
            found[i] = min(found[i], smooth(part.measured[:, i], part.period).noise_sd)
    return np.asarray(np.maximum(found, Data([recording], 1).resolution))


def _innovations(recording: Recording, sensed: NDArray[np.intp]) -> Array:
    """Standard deviations of the errors of a linear autoregression, (E,); infinite where the data are too few."""
    seen, commands = recording.measured[:, sensed], recording.commands[:, None]
    count = len(seen) - _MEMORY
    past = [rows[_MEMORY - k : len(seen) - k] for k in range(1, _MEMORY + 1) for rows in (seen, commands)]
    X = np.hstack([np.ones((count, 1)), *past])
    if count < _FEWEST * X.shape[1]:
        return np.full(len(sensed), np.inf)
    coefficients = np.linalg.lstsq(X, seen[_MEMORY:], rcond=None)[0]
    errors = seen[_MEMORY:] - X @ coefficients
    return np.asarray(np.sqrt((errors**2).sum(axis=0) / (count - X.shape[1])))


def _beside_its_rate(angle: Array, rate: Array, period: float) -> float:
    """Standard deviation of an angle's noise, by the rate that was measured beside it."""
    z = np.diff(angle) - 0.5 * period * (rate[1:] + rate[:-1])
    z -= z.mean()
    variance = float(np.mean(z**2) - 2.0 * np.mean(z[1:] * z[:-1])) / 4.0
    return float(np.sqrt(max(variance, 0.0)))
