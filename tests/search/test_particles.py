"""The cost by particles against moment matching, finite differences and a plain loop."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from twbal.core.cost import SaturatingCost
from twbal.core.gaussian import Gaussian
from twbal.models.function_samples import FunctionSamples
from twbal.models.moments.truncation import Truncation
from twbal.search.descent import Objective, descend
from twbal.search.particles import ParticleObjective
from twbal.search.starts import PolicyParametrisation, linear_policy
from twbal.search.torch_functions import SampledFunctions
from twbal.search.transition import transition_model

SHAPE = PolicyParametrisation(
    5, True, {"tilt": 0.15, "tilt_rate": 0.8, "speed": 0.5}, command_scale=0.4, weight_sd=0.05
)
START = Gaussian(np.array([-0.1, 0.0, 0.0, 0.0]), np.diag([0.02, 0.05, 0.02, 0.0]) ** 2)
COST = SaturatingCost(np.zeros(4), np.array([0.25, 2.5, 1.0, np.inf]))


@pytest.fixture(scope="module")
def model(make_system):
    return make_system(1, g=0.01, samples=80)[0]


@pytest.fixture(scope="module")
def policy(model):
    gain = np.array([-30.0, -4.0, -2.0, 0.1])
    return linear_policy(SHAPE, model.channels.names, 20.0, gain, np.random.default_rng(0))


def particles(model, count, horizon=15):
    return ParticleObjective(model, COST, START, horizon, count, 100, 0, 1e-4)


def test_many_particles_agree_with_moment_matching(model, policy):
    objective = particles(model, 4000, horizon=6)
    matched = Objective(transition_model(model), COST, START, 6, Truncation(1e-6, (2, 4, 6)), 1e-4).value(policy)
    assert objective.value(policy) == pytest.approx(matched, rel=0.02)


def test_the_gradient_is_that_of_finite_differences(model, policy):
    objective = particles(model, 30)
    gradient = objective.cost_of(policy, gradient=True).gradient
    rng = np.random.default_rng(1)
    for name in ("centres", "weights", "lengths", "gain"):
        along = rng.standard_normal(getattr(policy, name).shape)
        along *= 1e-5 / np.abs(along).max()
        ends = [objective.value(replace(policy, **{name: getattr(policy, name) + s * along})) for s in (1, -1)]
        assert (ends[0] - ends[1]) / 2 == pytest.approx(
            float((getattr(gradient, name) * along).sum()), rel=1e-4, abs=1e-12
        )


def test_functions_in_torch_are_those_in_numpy(model):
    inputs = np.random.default_rng(2).standard_normal((7, model.g.inputs))
    samples = FunctionSamples.draw(model.g, 7, 40, np.random.default_rng(3))
    np.testing.assert_allclose(SampledFunctions(samples)(torch.tensor(inputs)).numpy(), samples(inputs), atol=1e-10)


def test_descent_finds_less_cost(model, policy):
    objective = particles(model, 20)
    scales = SHAPE.scales(model.channels.names, 20.0)
    assert objective.value(descend(objective, policy, scales, True, 5)) < objective.value(policy)


def test_the_same_seed_gives_the_same_cost(model, policy):
    assert particles(model, 10).value(policy) == particles(model, 10).value(policy)
