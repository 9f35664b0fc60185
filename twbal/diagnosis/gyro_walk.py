"""By how much the bias of a gyro walks, from the noise that a model of the recordings was fitted with.

A random walk of the density q [rad/s/√s] adds q²·t to the variance of the bias in t seconds. The bias of the noise
model is a first-order Gauss-Markov process of the standard deviation σ and the time constant T (`sysid.noise`), which
walks with q = σ·√(2 / T) over times short beside T. The interval has all levels that the recordings do not make
unlikely: -2 log likelihood, divided by the autocorrelation of the residuals, is within 3.84 of its least value (S. S.
Wilks: The large-sample distribution of the likelihood ratio for testing composite hypotheses, Annals of Mathematical
Statistics 9 (1), 1938, 60-62). The other levels, and the model, stay as they were fitted.
"""

from collections.abc import Callable
from math import sqrt

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from twbal.diagnosis.hypothesis import FittedHypothesis
from twbal.diagnosis.side_findings import BiasWalk
from twbal.sysid.likelihood import cost
from twbal.sysid.model import Data
from twbal.sysid.noise import BIAS_TIME

_LEAST, _MOST = 1e-7, 0.3  # rad/s/√s; between which densities are looked for
_WITHIN = 3.84  # of -2 log likelihood: the 95 % quantile of χ² of one degree of freedom
_BIAS = 5  # of the components of a model discrepancy
_PER_LEVEL = sqrt(2.0 / BIAS_TIME)


def gyro_bias_walk(data: Data, chosen: FittedHypothesis) -> BiasWalk | None:
    """By how much the bias of the gyro walks under a fitted set of effects; None without a gyro.

    Args:
        data: that it was fitted to.
        chosen: the set.
    """
    model = chosen.fit.model
    if not (data.sensed[1] and model.noise.has_discrepancy):
        return None

    def unlikely(log_density: float) -> float:
        """-2 log likelihood over the residual autocorrelation."""
        levels = model.noise.discrepancy.copy()
        levels[_BIAS] = np.exp(log_density) / _PER_LEVEL
        kalman = data.filter(model._replace(noise=model.noise._replace(discrepancy=levels)))
        return cost(data.errors(model, kalman), data.usable, kalman) / chosen.autocorrelation

    fitted = float(np.log(np.clip(model.noise.discrepancy[_BIAS] * _PER_LEVEL, _LEAST, _MOST)))
    return _with_interval(unlikely, fitted)


def _with_interval(unlikely: Callable[[float], float], fitted: float) -> BiasWalk:
    """The likeliest density, and those that are nearly as likely, by their logarithms; `fitted` is one near it."""
    least, most = float(np.log(_LEAST)), float(np.log(_MOST))
    near = max(least, fitted - 3.0), min(most, fitted + 3.0)
    found = minimize_scalar(unlikely, bounds=near, method="bounded", options={"xatol": 0.02})
    best, value = min([(float(found.x), float(found.fun)), (fitted, unlikely(fitted))], key=lambda pair: pair[1])

    def beyond(log_density: float) -> float:
        return unlikely(log_density) - value - _WITHIN

    low = float(np.exp(brentq(beyond, least, best, xtol=0.02))) if beyond(least) > 0.0 else 0.0
    high = float(np.exp(brentq(beyond, best, most, xtol=0.02))) if beyond(most) > 0.0 else _MOST
    return BiasWalk(min(float(np.exp(best)), high), low, high)
