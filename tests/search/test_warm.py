"""What is compiled while setting up is what searches run."""

from dataclasses import replace

import numpy as np

from twbal.core.cost import SaturatingCost
from twbal.core.evaluation import SuccessCriterion
from twbal.core.gaussian import Gaussian
from twbal.models.moments.truncation import Truncation
from twbal.policies.rbf import RbfPolicy
from twbal.search.long_term_cost import _long_term_cost, long_term_cost
from twbal.search.sampled_rollouts import _drive
from twbal.search.transition import transition_model
from twbal.search.validation import Validation, validate
from twbal.search.warm import compile_search, is_compiled


def test_a_search_compiles_nothing_more(make_system):
    compile_search()
    assert is_compiled()
    before = [list(kernel.signatures) for kernel in (_long_term_cost, _drive)]
    model, _, _ = make_system(1, 0.5)
    policy = RbfPolicy(model.channels.names, np.zeros((2, 4)), np.ones(2), np.ones(4), np.zeros(4), 20.0)
    cost, start = SaturatingCost(np.zeros(4), np.ones(4)), Gaussian(np.zeros(4), 0.01 * np.eye(4))
    long_term_cost(transition_model(model), policy, cost, start, 3, Truncation())
    rule = SuccessCriterion(tilt_limit=0.5, settled_tilt_limit=0.2, settle_step=2, steps=4)
    for judged in (model, replace(model, g=None)):
        validate(judged, policy, cost, start, Validation(robots=2, features=5, success=rule), seed=0)
    assert [list(kernel.signatures) for kernel in (_long_term_cost, _drive)] == before
