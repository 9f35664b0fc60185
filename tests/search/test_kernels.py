"""Policy search on models with other kernels than the squared exponential: against plain loops over every robot."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from small_search import COST, SHAPE, START, balancing, check_gradient, particles

from twbal.core.errors import ConfigError
from twbal.core.gaussian import Gaussian
from twbal.models.fit_settings import FitSettings
from twbal.models.kernels.exact import fit_exact
from twbal.search.descent import descend
from twbal.search.optimise import search_policy
from twbal.search.sampled_rollouts import Draws, Limits, sampled_rollouts
from twbal.search.torch_functions import mean_function
from twbal.search.torch_robots import Robots
from twbal.search.validation import validate

FIT = FitSettings(1, 0.5, 60, 1, 30, 1000.0, 100.0)


@pytest.fixture(scope="module")
def model(make_system):
    """The robot of `make_system` with a Matérn f and g of what it has learned."""
    known = make_system(1, g=0.02, samples=60)[0]
    f = fit_exact(known.f.centres, known.f.mean(known.f.centres), "matern52+linear", FIT, 0, None).gp
    g = fit_exact(known.g.centres, known.g.mean(known.g.centres), "matern32", FIT, 0, None).gp
    return replace(known, f=f, g=g)


@pytest.fixture(scope="module")
def policy(model):
    return balancing(model)


def followed(model, policy, robots, i):
    """States of robot i, by numpy and one step after the other; its own g from the torch function."""
    state = robots.start[i].numpy()
    for noise, seeing in zip(robots.process[:, i].numpy(), robots.sensors[:, i].numpy(), strict=True):
        command = policy.command(state + seeing)
        inputs = np.append(state, command)
        every = torch.tensor(np.tile(inputs, (len(robots.start), 1)))
        change = model.f.mean(inputs[None])[0] + robots.g(every)[i].numpy() + noise
        state = model.transition_matrix @ inputs + model.selection @ change
        yield state


def test_the_cost_of_particles_is_that_of_robots_followed_one_by_one(model, policy):
    objective = particles(model, 6, horizon=8)
    states = np.array([list(followed(model, policy, objective._robots, i)) for i in range(6)])  # (P, H, D)
    assert objective.value(policy) == pytest.approx(COST(states).mean(axis=0).sum(), rel=1e-6)


def test_the_gradient_is_that_of_finite_differences(model, policy):
    check_gradient(particles(model, 10, horizon=8), policy, rel=1e-3, abs=1e-11)


def test_many_sampled_functions_agree_with_the_models_step_distribution(model, policy):
    objective = particles(model, 3000, horizon=1)
    objective = replace(objective, start=Gaussian(START.mean, np.zeros((4, 4))))
    ends = next(objective._robots.states(lambda seen: torch.full((len(seen),), 3.0, dtype=torch.float64))).numpy()
    step = model.step_distribution(START.mean[None], np.array([3.0]))
    measured = list(model.channels.measured)
    variance = step.variance[0] + model.process_noise
    np.testing.assert_allclose(
        ends[:, measured].mean(0), step.mean[0, measured], atol=5 * np.sqrt(variance.max() / 3000)
    )
    np.testing.assert_allclose(ends[:, measured].var(0), variance, rtol=0.25)


def test_rollouts_in_torch_are_the_compiled_ones(make_system, policy):
    known, _, _ = make_system(1, g=None, samples=60)
    rng, n, H = np.random.default_rng(0), 12, 60
    noises = [0.02 * rng.standard_normal((H, n, 4)), 0.002 * rng.standard_normal((H, n, 3))]
    draws = Draws(Gaussian(START.mean, 16.0 * START.covariance).sample(n, rng), *noises)
    limits = Limits(0, 0.15, 0.05, 30)
    compiled = sampled_rollouts(known, None, policy, COST, limits, draws)
    found = Robots.of(known, None, draws).balanced(policy.command, COST, limits)
    assert 0 < compiled.stayed.sum() < n
    np.testing.assert_array_equal(found.stayed, compiled.stayed)
    np.testing.assert_allclose(found.costs, compiled.costs, rtol=1e-8)


def test_a_judge_tells_a_policy_that_balances_from_one_that_does_not(model, policy, make_task):
    validation = replace(make_task(model).validation, robots=8)
    found = [validate(model, p, COST, START, validation, 0) for p in (policy, replace(policy, gain=0.0 * policy.gain))]
    assert found[0].cost < found[1].cost
    assert found[1].success == 0.0


def test_moment_matching_says_what_to_do_with_another_kernel(model, make_task):
    task = make_task(model)
    with pytest.raises(ConfigError, match=r"the model has matern52\+linear. Search by particles, with search="):
        search_policy(task, SHAPE, 20.0, [], lambda line: None)


def test_descent_finds_less_cost(model, policy):
    objective = particles(model, 6, horizon=8)
    scales = SHAPE.scales(model.channels.names, 20.0)
    assert objective.value(descend(objective, policy, scales, True, 3)) < objective.value(policy)


def test_a_posterior_of_neither_kind_is_refused():
    with pytest.raises(TypeError, match="found a int"):
        mean_function(1)
