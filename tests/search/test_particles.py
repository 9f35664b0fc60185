"""The cost by particles against moment matching, finite differences and a plain loop."""

import numpy as np
import pytest
import torch
from small_search import COST, SHAPE, START, balancing, check_gradient, particles

from twbal.models.function_samples import FunctionSamples
from twbal.models.moments.truncation import Truncation
from twbal.search.descent import Objective, descend
from twbal.search.torch_functions import SampledFunctions
from twbal.search.transition import transition_model


@pytest.fixture(scope="module")
def model(make_system):
    return make_system(1, g=0.01, samples=80)[0]


@pytest.fixture(scope="module")
def policy(model):
    return balancing(model)


def test_many_particles_agree_with_moment_matching(model, policy):
    objective = particles(model, 4000, horizon=6)
    matched = Objective(transition_model(model), COST, START, 6, Truncation(1e-6, (2, 4, 6)), 1e-4).value(policy)
    assert objective.value(policy) == pytest.approx(matched, rel=0.02)


def test_the_gradient_is_that_of_finite_differences(model, policy):
    check_gradient(particles(model, 30, horizon=15), policy, rel=1e-4, abs=1e-12)


def test_functions_in_torch_are_those_in_numpy(model):
    inputs = np.random.default_rng(2).standard_normal((7, model.g.inputs))
    samples = FunctionSamples.draw(model.g, 7, 40, np.random.default_rng(3))
    np.testing.assert_allclose(SampledFunctions(samples)(torch.tensor(inputs)).numpy(), samples(inputs), atol=1e-10)


def test_descent_finds_less_cost(model, policy):
    objective = particles(model, 20, horizon=15)
    scales = SHAPE.scales(model.channels.names, 20.0)
    assert objective.value(descend(objective, policy, scales, True, 5)) < objective.value(policy)


def test_the_same_seed_gives_the_same_cost(model, policy):
    first, again = (particles(model, 10, horizon=15).value(policy) for _ in range(2))
    assert first == again
