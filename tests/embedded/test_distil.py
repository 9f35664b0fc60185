"""Policies with fewer basis functions."""

from dataclasses import replace

import numpy as np
import pytest
from some_policies import POLICIES, widths_of

from twbal.core.errors import ConfigError
from twbal.embedded.distil import _Parameters, cost_of, distilled
from twbal.embedded.working_range import sampled_states


@pytest.fixture
def states(paper):
    def draw(policy, seed):
        return sampled_states(widths_of(policy, paper), 1500, np.random.default_rng(seed))

    return draw


def doubled(policy):
    """The same law with each basis function twice, at half its weight."""
    return replace(
        policy,
        centres=np.repeat(policy.centres, 2, axis=0),
        weights=np.repeat(policy.weights, 2) / 2,
    )


@pytest.mark.parametrize("name", ["paper", "friction"])
def test_functions_that_are_there_twice_are_left_out_at_no_cost(name, states, paper):
    whole = doubled(POLICIES[name])
    count = np.count_nonzero(POLICIES[name].weights)
    made = distilled(whole, count, states(whole, 0))
    assert len(made.weights) == count
    cost = cost_of(whole, made, states(whole, 1), widths_of(whole, paper))
    assert cost.max_command < 1e-6
    assert cost.former_basis == 2 * count


def test_fewer_functions_cost_more(states, paper):
    whole = POLICIES["searched"]
    costs = [
        cost_of(whole, distilled(whole, n, states(whole, 0)), states(whole, 1), widths_of(whole, paper))
        for n in (0, 4, 12)
    ]
    assert costs[0].rms_command > 3 * costs[1].rms_command > 9 * costs[2].rms_command
    assert costs[0].rms_gain > costs[1].rms_gain > costs[2].rms_gain
    assert costs[1].rms_command < 0.005


def test_its_derivatives_are_those_of_its_commands(states):
    policy = POLICIES["friction"]
    parameters = _Parameters(policy, policy.centres[:3] / policy.lengths)
    vector = parameters.with_linear_fit(states(policy, 0), policy.activation(states(policy, 0)))
    some = 0.1 * states(policy, 1)[:50]
    found = parameters.jacobian(vector, some)
    for place in range(len(vector)):
        step = np.zeros(len(vector))
        step[place] = 1e-6
        differences = (parameters.commands(vector + step, some) - parameters.commands(vector - step, some)) / 2e-6
        np.testing.assert_allclose(found[:, place], differences, atol=2e-5)


@pytest.mark.parametrize(("name", "basis", "said"), [("linear", 3, "LinearPolicy"), ("searched", 30, "than the 30")])
def test_what_cannot_be_made_smaller_is_refused(name, basis, said, states):
    with pytest.raises(ConfigError, match=said):
        distilled(POLICIES[name], basis, states(POLICIES[name], 0))
