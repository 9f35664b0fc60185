"""The correction of probabilities of success, and its fit."""

import numpy as np
import pytest
from hydra.utils import instantiate
from scipy.special import expit, logit

from benchmarks.hidden_robots.reliability import Driven, fitted, recorded
from twbal.cli.composed import composed
from twbal.search.reliability import success_probability


@pytest.mark.parametrize(("intercept", "slope"), [(0.0, 1.0), (1.5, 0.4), (-0.7, 0.0)])
def test_a_correction_is_found_from_policies_that_succeed_by_it(intercept, slope):
    rng = np.random.default_rng(0)
    given = rng.uniform(0.05, 0.99, 4000)
    successes = rng.binomial(10, expit(intercept + slope * logit(given)))
    policies = [Driven("a", 0, 0, p, int(k), 10) for p, k in zip(given, successes, strict=True)]
    assert fitted(policies) == pytest.approx((intercept, slope), abs=0.08)


def test_the_configured_corrections_are_those_of_the_recorded_policies():
    robust = instantiate(composed("iterate").robust)
    for told, configured in ((False, robust.reliability_sheet), (True, robust.reliability_rollouts)):
        found = fitted([policy for policy in recorded() if (policy.iteration > 0) == told])
        assert configured == pytest.approx(found, abs=0.005)


def test_a_corrected_probability_grows_with_the_share_and_is_never_certain():
    shares = [success_probability(k / 60, 60, (1.9, 0.4)) for k in range(61)]
    assert shares == sorted(shares)
    assert 0.0 < shares[0] < shares[-1] < 1.0
    assert success_probability(0.5, 60, (3.0, 0.0)) == pytest.approx(expit(3.0))
