"""Compiled rollouts, beside the same rollouts by the classes that they are compiled from."""

import numpy as np
import pytest

from twbal.core.cost import SaturatingCost
from twbal.models.function_samples import FunctionSamples
from twbal.policies.rbf import RbfPolicy
from twbal.search.sampled_rollouts import Draws, Limits, cosine_in_place, sampled_rollouts

COST = SaturatingCost(np.zeros(4), np.array([0.25, 2.5, 1.0, 20.0]))
ROBOTS, STEPS = 12, 120


def draws_of(model, spread, seed):
    rng = np.random.default_rng(seed)
    D = len(model.channels.names)
    return Draws(
        start=spread * rng.standard_normal((ROBOTS, D)),
        sensors=0.001 * rng.standard_normal((STEPS, ROBOTS, D)),
        process=0.001 * rng.standard_normal((STEPS, ROBOTS, D - 1)),
    )


def policy_of(gain, seed=0):
    """A linear law with a small network on top."""
    rng = np.random.default_rng(seed)
    centres, weights = 0.2 * rng.standard_normal((5, 4)), 0.02 * rng.standard_normal(5)
    return RbfPolicy(("tilt", "tilt_rate", "speed", "command_1"), centres, weights, np.full(4, 0.5), gain, 20.0)


def step_by_step(model, samples, policy, limits, draws):
    """The same rollouts by the GP, its samples, the policy and the cost themselves."""
    states, A, P = draws.start, model.transition_matrix, model.selection
    stayed, fallen, costs = np.ones(ROBOTS, bool), np.zeros(ROBOTS, bool), np.zeros(ROBOTS)
    for step in range(STEPS):
        inputs = np.column_stack([states, policy.command(states + draws.sensors[step])])
        change = model.f.mean(inputs) + draws.process[step]
        if samples is not None:
            change = change + samples(inputs)
        states = np.clip(inputs @ A.T + change @ P.T, -1e3, 1e3)
        angle = np.abs(states[:, limits.tilt])
        fallen |= angle > limits.limit
        stayed &= ~fallen & ((step + 1 < limits.settle_step) | (angle <= limits.settled_tilt_limit))
        costs += np.where(fallen, 1.0, COST(states))
    return stayed, costs / STEPS


@pytest.mark.parametrize("g", [None, 0.3])
@pytest.mark.parametrize("strength", [1.0, 0.0])
def test_compiled_rollouts_are_those_of_the_classes(make_system, g, strength):
    model, _, _ = make_system(1, g=g)
    policy = policy_of(strength * np.array([2.0, 0.4, 0.27, 0.0]))
    samples = FunctionSamples.draw(model.g, ROBOTS, 40, np.random.default_rng(3)) if model.g else None
    limits, draws = Limits(0, 0.5, 0.1, 60), draws_of(model, [0.08, 0.1, 0.05, 0.0], 1)
    found = sampled_rollouts(model, samples, policy, COST, limits, draws)
    stayed, costs = step_by_step(model, samples, policy, limits, draws)
    np.testing.assert_array_equal(found.stayed, stayed)
    np.testing.assert_allclose(found.costs, costs, rtol=1e-6)
    if strength:
        assert stayed.sum() > 0
    else:
        assert not stayed.any()


def test_cosines_are_cosines():
    angles = np.concatenate([np.linspace(-20, 20, 4001), [1e3, -777.7, 0.0, np.pi, -np.pi / 2]])
    found = angles.copy()
    cosine_in_place(found)
    np.testing.assert_allclose(found, np.cos(angles), atol=1e-13)
