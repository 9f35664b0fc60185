"""What is compiled while setting up is what searches run."""

import numpy as np

from twbal.cost import SaturatingCost
from twbal.gaussian import Gaussian
from twbal.models.moments.prediction import Truncation
from twbal.policies.rbf import RbfPolicy
from twbal.search.long_term_cost import _long_term_cost, long_term_cost
from twbal.search.transition import transition_model
from twbal.search.warm import compile_search, is_compiled


def test_a_search_compiles_nothing_more(make_system):
    compile_search()
    assert is_compiled()
    before = list(_long_term_cost.signatures)
    model, _, _ = make_system(1, 0.5)
    policy = RbfPolicy(model.channels.names, np.zeros((2, 4)), np.ones(2), np.ones(4), np.zeros(4), 20.0)
    cost, start = SaturatingCost(np.zeros(4), np.ones(4)), Gaussian(np.zeros(4), 0.01 * np.eye(4))
    long_term_cost(transition_model(model), policy, cost, start, 3, Truncation())
    assert _long_term_cost.signatures == before
