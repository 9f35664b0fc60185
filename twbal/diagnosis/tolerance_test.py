"""How badly the recordings want the data sheet to be off by more than its tolerances.

In a fit the tolerances are standard deviations, and several values share what one is off by: a body that is 12 % too
heavy pulls its mass, its inertia and the motors' gain by little more than a standard deviation each. As limits they say
more: no values within them explain such a robot.
"""

from collections.abc import Mapping

import numpy as np
from scipy.optimize import lsq_linear

from twbal.sysid.model import Data, Field
from twbal.sysid.prediction_error_fit import Fit, slopes_of

_FEW = 1e-9  # room within bounds that a value may stand on, in standard deviations


def tolerance_statistic(data: Data, fit: Fit, tolerances: Mapping[Field, float]) -> float:
    """Gain in -2 log likelihood of a fit over the best one whose data sheet is within its tolerances.

    From the slopes at the optimum, so a bounded linear least-squares problem; factors multiply, and at their limits
    reach a little farther than this sum of them, so it is up to a third too large. Values of the data sheet that are
    named (that have no prior) stay free, and so does all else within its own bounds and prior.

    Args:
        data: recordings.
        fit: at its optimum.
        tolerances: shares by which values of the data sheet, and of effects that are given, may be off, by field.
    """
    values, J = fit.values, slopes_of(data, fit)
    scales = np.array([free.sd if np.isfinite(free.sd) else free.high - free.low for free in fit.free_parameters])
    low, high, priors, aims = [], [], [], []
    for i, (free, value) in enumerate(zip(fit.free_parameters, values, strict=True)):
        ends = (free.low, free.high)
        if free.field in tolerances and np.isfinite(free.sd):
            tolerance = tolerances[free.field] * abs(free.mean)
            ends = (free.mean - tolerance, free.mean + tolerance)
        elif np.isfinite(free.sd):
            priors.append(np.eye(len(values))[i])
            aims.append((free.mean - value) / free.sd)
        low.append((ends[0] - value) / scales[i] - _FEW)
        high.append((ends[1] - value) / scales[i] + _FEW)
    A, b = np.vstack([J * scales, *priors]), np.concatenate([-fit.white, aims])
    within = lsq_linear(A, b, (low, high), method="bvls")
    return float(2.0 * within.cost - b @ b)
