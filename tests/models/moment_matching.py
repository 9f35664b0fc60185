"""Moment matching as tests call it: with a truncation, and without a reference where none is given."""

import numpy as np

from twbal.models.moments.moment_prediction import predict_by_series
from twbal.models.moments.truncation import series


def predict(f, g, mean, covariance, truncation, start_degree=2, reference=0.0):
    """Moments of f(x) + g(x) for x ~ N(mean, covariance); arguments as of `predict_by_series`."""
    beside = np.zeros(len(f.weights)) + reference
    mean, covariance = np.ascontiguousarray(mean), np.ascontiguousarray(covariance)
    return predict_by_series(f, g, mean, covariance, series(truncation, len(mean)), start_degree, beside)
