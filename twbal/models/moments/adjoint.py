"""The way back from the derivatives by predicted moments to those by the moments of the input."""

import numpy as np

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array
from twbal.models.moments.hermite import higher_covariance_adjoint, term_weights
from twbal.models.moments.moment_prediction import MomentPrediction
from twbal.models.moments.multi_index import Integers, MultiIndices
from twbal.models.moments.truncation import EXACT


@kernel()
def _first_moments_adjoint(T: Array, by_value: Array, by_slope: Array, up: Integers):  # type: ignore[no-untyped-def]
    """Way back from the mean and the slope, all along the columns of R."""
    outputs, d = by_slope.shape
    by_mean, by_input = np.zeros(d), np.zeros((d, d))
    for a in range(outputs):
        for k in range(d):
            by_mean[k] += by_value[a] * T[a, 1 + k]
            for l in range(d):
                second = T[a, up[up[0, k], l]]
                by_mean[k] += by_slope[a, l] * second
                by_input[k, l] += 0.5 * by_value[a] * second
                for j in range(d):
                    by_input[k, l] += 0.5 * by_slope[a, j] * T[a, up[up[up[0, j], k], l]]
    return by_mean, by_input


@kernel()
def predict_adjoint(  # type: ignore[no-untyped-def]
    prediction: MomentPrediction,
    covariance: Array,
    indices: MultiIndices,
    by_value: Array,
    by_slope: Array,
    by_rest: Array,
):
    """From the derivatives by mean, slope and rest to those by the input's mean (d,) and covariance (d, d) (eq. 15-16).

    Args:
        covariance: S that the prediction was made at, (d, d).
        indices: of its series.
        by_value: (E,).
        by_slope: (E, d).
        by_rest: (E, E), symmetric.
    """
    inverse = prediction.inverse_basis
    outputs, d = by_slope.shape
    direct = np.zeros((d, d))
    if prediction.degree == EXACT:
        by_slope = by_slope - 2.0 * (by_rest @ prediction.slope @ covariance)
        direct -= prediction.slope.T @ by_rest @ prediction.slope
    by_mean, by_input = _first_moments_adjoint(prediction.derivatives, by_value, by_slope @ inverse.T, indices.up)
    if prediction.degree != EXACT:
        weights = term_weights(prediction.eigenvalues, indices, prediction.derivatives.shape[1])
        dm, ds = higher_covariance_adjoint(prediction.derivatives, weights, by_rest, indices, prediction.degree)
        by_mean, by_input = by_mean + dm, by_input + ds
    by_mean = inverse.T @ by_mean
    by_covariance = inverse.T @ by_input @ inverse + direct
    for a in range(outputs):
        for b in range(outputs):
            by_mean += by_rest[a, b] * prediction.exact_by_mean[a, b]
            by_covariance += by_rest[a, b] * prediction.exact_by_covariance[a, b]
    return by_mean, by_covariance
