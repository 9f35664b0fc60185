from dataclasses import replace

import numpy as np
import pytest

from twbal.core.cost import SaturatingCost
from twbal.core.gaussian import Gaussian
from twbal.models.moments.truncation import EXACT, Truncation
from twbal.policies.rbf import RbfPolicy
from twbal.search.long_term_cost import long_term_cost, propagate
from twbal.search.transition import transition_model

SCALES = np.array([0.15, 0.8, 0.5, 8.0, 8.0, 0.3, 0.2])
PAIRS, SERIES = Truncation(degrees=()), Truncation(0.0, (4,), fall_back=False)


def random_policy(channels, seed=0, N=6, linear=1.0):
    rng = np.random.default_rng(seed)
    D = len(channels)
    gain = linear * rng.standard_normal(D) / SCALES[:D] / D
    lengths = SCALES[:D] * rng.uniform(1.0, 3.0, D)
    centres, weights = rng.standard_normal((N, D)) * SCALES[:D], 0.3 * rng.standard_normal(N)
    return RbfPolicy(channels, centres, weights, lengths, gain, 20.0)


def cost_and_start(D):
    change = np.array([0.0, 0.0, 0.0, 1 / 6, -1 / 6, 0.0, 0.0])[:D] if D > 5 else np.zeros(D)
    cost = SaturatingCost(0.05 * SCALES[:D], np.array([0.25, 2.5, np.inf, 20.0, np.inf, 0.5, 0.5])[:D], change)
    rng = np.random.default_rng(1)
    root = 0.2 * SCALES[:D, None] * (np.eye(D) + 0.3 * rng.standard_normal((D, D)))
    return cost, Gaussian(-0.3 * SCALES[:D], root @ root.T)


@pytest.mark.parametrize("truncation", [PAIRS, SERIES], ids=["pairs", "series"])
@pytest.mark.parametrize(
    ("lags", "g", "process", "sensors", "place", "compensation"),
    [
        (0, None, 0.0, 0.0, False, 0.0),
        (0, 0.5, 0.0, 0.0, False, 0.0),
        (0, None, 1e-3, 1e-3, False, 0.0),
        (2, 0.5, 1e-3, 2e-3, False, 0.0),
        (2, 0.5, 1e-3, 2e-3, True, 0.0),
        (2, 0.5, 1e-3, 2e-3, True, 0.4),
    ],
    ids=["f", "f+g", "f, noises", "f+g, noises, past commands", "and place", "and place, compensation"],
)
def test_the_gradient_equals_finite_differences_for_every_parameter(
    make_system, lags, g, process, sensors, truncation, place, compensation
):
    model, _, _ = make_system(lags, g, 25, process, sensors, place)
    D = 3 + lags + 2 * place
    policy = replace(random_policy(model.channels.names), compensation=compensation)
    cost, start = cost_and_start(D)
    dynamics = transition_model(model)
    found = long_term_cost(dynamics, policy, cost, start, 6, truncation)
    assert 0.5 < found.value < 5.5  # neither on target nor fallen
    assert (found.exact_steps == 6) == (truncation is PAIRS)
    step = 1e-3 if compensation else 3e-3  # a jump of the command is steep
    sizes = {"centres": SCALES[:D], "weights": 0.3, "lengths": SCALES[:D], "gain": 1 / SCALES[:D]}
    for name, size in sizes.items():
        values, ours = getattr(policy, name), getattr(found.gradient, name)
        steps = step * np.broadcast_to(size, values.shape)
        numeric = np.empty_like(values)
        for place in np.ndindex(values.shape):
            ends = []
            for h in (-2, -1, 1, 2):
                moved = values.copy()
                moved[place] += h * steps[place]
                changed = replace(policy, **{name: moved})
                ends.append(long_term_cost(dynamics, changed, cost, start, 6, truncation, gradient=False).value)
            numeric[place] = np.dot([1, -8, 8, -1], ends) / 12
        assert np.abs(numeric).max() > 1e-6
        np.testing.assert_allclose(ours * steps, numeric, rtol=1e-6, atol=1e-6 * np.abs(numeric).max(), err_msg=name)


@pytest.mark.parametrize(("lags", "place"), [(0, False), (2, False), (2, True)])
def test_a_linear_loop_is_followed_exactly_with_all_its_noises(make_system, lags, place):
    model, A, B = make_system(lags, None, 150, 1e-5, 1e-4, place)
    D = 3 + lags + 2 * place
    _, start = cost_and_start(D)
    start = Gaussian(0.05 * start.mean, 0.01 * start.covariance)  # where the squash is straight: σ(a) = 1.5 a + O(a⁵)
    K = np.array([-60.0, -12.0, -6.0, 0.05, 0.02, -1.0, -0.2])[:D]
    gain = -K / (20.0 * 1.5)
    policy = replace(random_policy(model.channels.names), weights=np.zeros(6), gain=gain)
    steps = propagate(transition_model(model), policy, start, 15, Truncation())
    mean, S = start
    disturbed = np.zeros((D, 3))  # a disturbance of the speed within a period moves the robot, too
    disturbed[:3] = np.eye(3)
    if place:
        disturbed[5, 2] = 0.5 * model.channels.control_period
    noise, seen = disturbed @ np.diag(model.process_noise) @ disturbed.T, np.zeros(D)
    seen[:3] = model.observation_noise
    loop = A - np.outer(B, K)
    for step in steps:
        mean = loop @ mean
        S = loop @ S @ loop.T + np.outer(B, B) * (K @ np.diag(seen) @ K) + noise
        sd = np.sqrt(np.diag(S))
        np.testing.assert_allclose(step.next_state.mean, mean, atol=0.02 * np.abs(sd).max())
        np.testing.assert_allclose(step.next_state.covariance / np.outer(sd, sd), S / np.outer(sd, sd), atol=0.02)
    assert np.abs(mean[0]) < 0.5 * np.abs(start.mean[0])


@pytest.mark.parametrize(("lags", "place", "compensation"), [(1, False, 0.0), (2, True, 0.0), (2, True, 0.4)])
def test_one_step_lies_within_4_standard_errors_of_samples(make_system, lags, place, compensation):
    model, _, _ = make_system(lags, 0.3, 40, 1e-4, 3e-4, place)
    D = 3 + lags + 2 * place
    _, start = cost_and_start(D)
    policy = random_policy(model.channels.names)
    policy = replace(policy, weights=np.zeros(6), compensation=compensation)  # its activation is normal exactly
    step = propagate(transition_model(model), policy, start, 1, Truncation())[0]
    rng, count = np.random.default_rng(0), 100_000
    states = start.sample(count, rng)
    noise = np.zeros(D)
    noise[:3] = model.observation_noise
    commands = policy.command(states + np.sqrt(noise) * rng.standard_normal(states.shape))
    joint = np.column_stack([states, commands])
    within_4_standard_errors(joint, step.joint)
    drawn = step.joint.sample(count, rng)  # moment matching means a normal (x, u) from here on
    after = model.step_distribution(drawn[:, :D], drawn[:, D])
    ends = after.mean.copy()
    moved = np.sqrt(after.variance + model.process_noise) * rng.standard_normal((count, 3))
    ends[:, :3] += moved
    if place:
        ends[:, 5] += 0.5 * model.channels.control_period * moved[:, 2]
    within_4_standard_errors(ends, step.next_state)


def within_4_standard_errors(drawn, expected):
    gaps = drawn - expected.mean
    assert (np.abs(gaps.mean(0)) < 4 * gaps.std(0) / np.sqrt(len(gaps))).all()
    products = gaps[:, :, None] * gaps[:, None, :]
    assert (np.abs(products.mean(0) - expected.covariance) < 4 * products.std(0) / np.sqrt(len(gaps)) + 1e-12).all()


def test_states_stay_normal_distributions_over_a_fall(make_system):
    model, _, _ = make_system(2, 0.5)
    policy = random_policy(model.channels.names, seed=3, linear=3.0)
    steps = propagate(transition_model(model), policy, cost_and_start(5)[1], 40, Truncation(1e-5, (2, 4), False))
    for step in steps:
        correlation = step.next_state.covariance / np.outer(step.next_state.sd, step.next_state.sd)
        np.testing.assert_allclose(correlation, correlation.T, rtol=1e-12)
        assert np.linalg.eigvalsh(correlation).min() > -1e-9


def test_past_commands_are_carried_on(make_system):
    model, _, _ = make_system(2, 0.5)
    steps = propagate(
        transition_model(model), random_policy(model.channels.names), cost_and_start(5)[1], 5, Truncation()
    )
    for step in steps:
        assert step.next_state.mean[3] == pytest.approx(step.joint.mean[5])
        assert step.next_state.covariance[3, 3] == pytest.approx(step.joint.covariance[5, 5])
        assert step.next_state.mean[4] == pytest.approx(step.state.mean[3])
        assert step.next_state.covariance[4, 3] == pytest.approx(step.joint.covariance[3, 5])


def test_the_variance_of_f_counts_only_where_it_is_kept_and_that_of_g_always(make_system):
    model, _, _ = make_system(0, 0.5, 8)
    policy, (_, start) = random_policy(model.channels.names), cost_and_start(3)
    start = Gaussian(start.mean, 1e-12 * np.eye(3))
    policy = replace(policy, gain=np.zeros(3), weights=np.zeros(6))
    ends = [
        propagate(transition_model(m), policy, start, 1, Truncation())[0].next_state.covariance
        for m in (replace(model, g=None), model, replace(model, keep_f_variance=True))
    ]
    at = np.append(start.mean, 0.0)[None, :]
    f, g = model.f.predict(at).variance[0], model.g.predict(at).variance[0]
    for end, expected in zip(ends, (0.0, g, f + g), strict=True):
        np.testing.assert_allclose(np.diag(end) - model.process_noise, expected, rtol=1e-3, atol=1e-9)


def test_the_series_and_pairs_agree_on_the_cost(make_system):
    model, _, _ = make_system(1, 0.5, 40)
    policy, (cost, start) = random_policy(model.channels.names), cost_and_start(4)
    dynamics = transition_model(model)
    series, pairs = (long_term_cost(dynamics, policy, cost, start, 10, t) for t in (Truncation(), PAIRS))
    assert series.exact_steps < 10
    assert series.value == pytest.approx(pairs.value, rel=1e-6)
    for one, other in zip(series.gradient, pairs.gradient, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-4 * np.abs(other).max())
    assert pairs.exact_steps == 10 and EXACT == 0
