"""The expected separation of two models, beside the mean log likelihood ratio of normal noise."""

import numpy as np
import pytest
from scipy.stats import multivariate_t

from twbal.diagnosis.separation import projected
from twbal.sysid.likelihood import whiten

COUNT = 400_000


@pytest.mark.parametrize(("channels", "more"), [(2, 1.19), (3, 1.23), (4, 1.27)])
def test_it_is_as_much_more_than_the_mean_log_likelihood_ratio_as_is_said(channels, more):
    """Errors of 1 in each measured channel, by 0.3 off in one of them by the other model."""
    errors = np.zeros((COUNT + 1, 4))
    errors[1:, :channels] = np.random.default_rng(0).standard_normal((COUNT, channels))
    off = np.array([0.3, 0.0, 0.0, 0.0])
    usable, eye = np.ones(COUNT + 1, bool), np.eye(4)[None]
    ours, theirs = (whiten(each, usable, eye, channels).ravel() for each in (errors, errors + off))
    found = projected(theirs - ours, np.zeros((len(ours), 0)), np.zeros((0, 0)))
    density = multivariate_t(np.zeros(channels), 0.8 * np.eye(channels), df=10.0)  # of unit covariance

    def mean_log_density(shift):
        return float(np.mean(density.logpdf((errors[1:] + shift)[:, :channels])))

    ratio = COUNT * (mean_log_density(0.0 * off) - 0.5 * (mean_log_density(off) + mean_log_density(-off)))
    assert found / ratio == pytest.approx(more, abs=0.01)
