from dataclasses import replace

import numpy as np
import pytest
import scipy.optimize

from twbal.core.cost import SaturatingCost
from twbal.core.gaussian import Gaussian
from twbal.models.moments.truncation import Truncation
from twbal.search.descent import Objective, descend
from twbal.search.starts import PolicyParametrisation, linear_policy
from twbal.search.transition import transition_model

SCALES = np.array([0.15, 0.8, 0.5])
SHAPE = PolicyParametrisation(6, True, {"tilt": 0.15, "tilt_rate": 0.8, "speed": 0.5}, command_scale=0.4, weight_sd=0.3)
START = Gaussian(np.array([-0.12, 0.0, 0.0]), np.diag([0.02, 0.1, 0.05]) ** 2)


@pytest.fixture(scope="module")
def objective(make_system):
    model, _, _ = make_system(samples=60)
    cost = SaturatingCost(np.zeros(3), np.array([0.25, 2.5, 1.0]))
    return Objective(transition_model(model), cost, START, 12, Truncation(1e-5, (2, 4), False), weight_penalty=1e-3)


def random_start(seed, gain=(0.0, 0.0, 0.0)):
    return linear_policy(SHAPE, ("tilt", "tilt_rate", "speed"), 20.0, np.array(gain), np.random.default_rng(seed))


def total(objective, policy):
    return objective.value(policy) + objective.weight_penalty * policy.weights @ policy.weights


@pytest.mark.parametrize("linear", [True, False])
def test_the_objective_never_rises(objective, linear):
    for seed in range(4):
        start = random_start(seed, gain=np.random.default_rng(seed).normal(0, [60, 12, 6]))
        courses = [total(objective, descend(objective, start, SCALES, linear, n)) for n in (1, 3, 10)]
        assert max(courses) <= total(objective, start) + 1e-9
        assert courses[-1] < total(objective, start) - 1e-3


def test_the_slope_is_zero_where_it_ends(objective):
    penalised = replace(objective, weight_penalty=0.3, horizon=6)
    start = random_start(0, gain=(-60.0, -12.0, -6.0))
    sizes = {"centres": SCALES, "weights": np.ones(6), "lengths": SCALES, "gain": 1.0 / SCALES}

    def slopes(policy):
        """By every parameter, in the units that are searched."""
        for name, size in sizes.items():
            values = getattr(policy, name)
            for place in np.ndindex(values.shape):
                step = np.zeros_like(values)
                step[place] = 1e-4 * np.broadcast_to(size, values.shape)[place]
                ends = [total(penalised, replace(policy, **{name: values + s * step})) for s in (1, -1)]
                yield abs(ends[0] - ends[1]) / 2e-4

    found = descend(penalised, start, SCALES, True, 300)
    assert max(slopes(found)) < 1e-3 * max(slopes(start))


@pytest.mark.parametrize("linear", [True, False])
def test_the_optimiser_is_given_the_gradient_of_the_value_it_is_given(objective, linear, monkeypatch):
    given = []

    def spy(function, vector, **options):
        given.append((function, vector))
        return scipy.optimize.OptimizeResult(x=vector)

    monkeypatch.setattr(scipy.optimize, "minimize", spy)
    start = random_start(2, gain=(-60.0, -12.0, -6.0))
    same = descend(objective, start, SCALES, linear, 1)
    ((function, vector),) = given
    value, gradient = function(vector)
    numeric = [(function(vector + 1e-5 * e)[0] - function(vector - 1e-5 * e)[0]) / 2e-5 for e in np.eye(len(vector))]
    np.testing.assert_allclose(gradient, numeric, rtol=1e-4, atol=1e-6 * np.abs(numeric).max())
    assert value == pytest.approx(total(objective, start))
    np.testing.assert_allclose(same.lengths, start.lengths, rtol=1e-12)


def test_what_is_not_searched_stays(objective):
    start = random_start(0, gain=(-60.0, -12.0, -6.0))
    found = descend(objective, start, SCALES, False, 5)
    assert np.array_equal(found.gain, start.gain)
    assert not np.array_equal(found.weights, start.weights)
    assert (found.channels, found.max_command) == (start.channels, start.max_command)
    assert (found.lengths > 0).all()


def test_units_of_the_channels_do_not_matter(objective):
    start = random_start(1, gain=(-60.0, -12.0, -6.0))
    units = np.array([57.3, 57.3, 100.0])
    f = objective.model.f
    wide = np.append(units, 1.0)
    model = objective.model._replace(
        f=f._replace(
            inputs=f.inputs * wide,
            length_scales=f.length_scales * wide,
            weights=f.weights / units[:, None],
            signal_variance=f.signal_variance * units**2,
        ),
        g=objective.model.g._replace(length_scales=np.ones((3, 4))),
        process_noise=objective.model.process_noise * units**2,
        observation_noise=objective.model.observation_noise * units**2,
    )
    other = replace(
        objective,
        model=model,
        cost=SaturatingCost(np.zeros(3), objective.cost.widths * units),
        start=Gaussian(START.mean * units, START.covariance * np.outer(units, units)),
    )
    scaled = replace(start, centres=start.centres * units, lengths=start.lengths * units, gain=start.gain / units)
    one, two = descend(objective, start, SCALES, True, 4), descend(other, scaled, SCALES * units, True, 4)
    assert total(other, two) == pytest.approx(total(objective, one), rel=1e-4)
    np.testing.assert_allclose(two.gain * units, one.gain, rtol=1e-2)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e200])
def test_a_cost_that_is_not_finite_counts_as_infinite_and_leaves_the_start(objective, bad):
    start = replace(random_start(0), gain=np.array([bad, 0.0, 0.0]))
    assert objective.value(start) == np.inf
    found = descend(objective, start, SCALES, True, 5)
    assert np.array_equal(found.gain, start.gain, equal_nan=True)


def test_a_broken_model_costs_infinitely_much(objective):
    f = objective.model.f
    broken = replace(objective, model=objective.model._replace(f=f._replace(weights=np.full_like(f.weights, np.nan))))
    assert broken.value(random_start(0)) == np.inf
