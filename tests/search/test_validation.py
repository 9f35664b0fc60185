from dataclasses import replace

import numpy as np
import pytest

from twbal.core.channels import Channels
from twbal.core.cost import SaturatingCost
from twbal.core.errors import ConfigError
from twbal.core.evaluation import SuccessCriterion
from twbal.core.gaussian import Gaussian
from twbal.policies.rbf import RbfPolicy
from twbal.search.reliability import success_probability
from twbal.search.validation import Validation, validate

RULE = SuccessCriterion(tilt_limit=0.5, settled_tilt_limit=0.17, settle_step=60, steps=150)
VALIDATION = Validation(robots=20, features=100, success=RULE)
COST = SaturatingCost(np.zeros(3), np.array([0.25, 2.5, 1.0]))
START = Gaussian(np.array([-0.1, 0.0, 0.0]), np.diag([0.01, 0.02, 0.01]) ** 2)
HOLDING = np.array([60.0, 12.0, 8.0])


def policy_of(gain, names=("tilt", "tilt_rate", "speed")):
    """u = gain · x where the squash is straight."""
    D = len(names)
    return RbfPolicy(names, np.zeros((1, D)), np.zeros(1), np.ones(D), gain / 30.0, 20.0)


def test_a_stable_loop_balances_all_robots_and_an_unstable_one_none(make_system):
    model, A, B = make_system()
    assert np.abs(np.linalg.eigvals(A + np.outer(B, HOLDING))).max() < 1.0
    held = validate(model, policy_of(HOLDING), COST, START, VALIDATION, seed=0)
    fallen = validate(model, policy_of(np.zeros(3)), COST, START, VALIDATION, seed=0)
    assert held.success == 1.0
    assert fallen.success == 0.0
    assert held.cost < 0.2
    assert 0.5 < fallen.cost <= 1.0


def test_the_verdict_repeats_by_its_seed_and_not_by_another(make_system):
    model, _, _ = make_system(g=0.3)
    one, same, other = (validate(model, policy_of(HOLDING), COST, START, VALIDATION, seed) for seed in (1, 1, 2))
    assert one == same
    assert one.cost != other.cost


def test_each_robot_keeps_a_difference_of_its_own_so_some_fall_and_some_do_not(make_system):
    model, _, _ = make_system(g=0.3)
    known = replace(model, g=None)
    policy = policy_of(0.8 * HOLDING)
    assert validate(known, policy, COST, START, VALIDATION, 0).success == 1.0
    success = validate(model, policy, COST, START, replace(VALIDATION, robots=60), 0).success
    assert 0.0 < success < 1.0


def test_sensor_noise_reaches_the_policy(make_system):
    model, _, _ = make_system()
    loud = replace(model, observation_noise=np.array([0.15, 1.0, 0.5]) ** 2)
    quiet, noisy = (validate(m, policy_of(HOLDING), COST, START, VALIDATION, 0) for m in (model, loud))
    assert noisy.cost > quiet.cost + 0.05


def test_disturbances_of_the_state_count(make_system):
    model, _, _ = make_system()
    rough = replace(model, process_noise=np.array([0.02, 0.3, 0.05]) ** 2)
    calm, shaken = (validate(m, policy_of(HOLDING), COST, START, VALIDATION, 0) for m in (model, rough))
    assert shaken.cost > calm.cost + 0.05


def test_a_fallen_robot_costs_one_for_the_rest_of_the_trial(make_system):
    model, A, _ = make_system()
    free = SaturatingCost(np.zeros(3), np.array([1e9, np.inf, np.inf]))
    steps, x = 0, START.mean
    while np.abs(x[0]) <= RULE.tilt_limit:
        steps, x = steps + 1, A @ x
    start, still = START._replace(covariance=1e-8 * np.eye(3)), policy_of(np.zeros(3))
    found = validate(replace(model, process_noise=np.zeros(3)), still, free, start, VALIDATION, 0)
    assert found.cost == pytest.approx((RULE.steps - steps + 1) / RULE.steps, abs=2 / RULE.steps)
    # Also one that the policy would have raised again, were nobody to end the trial.
    narrow = replace(VALIDATION, success=replace(RULE, tilt_limit=0.08, settled_tilt_limit=0.08))
    raised = validate(model, policy_of(HOLDING), free, start, narrow, 0)
    assert (raised.success, raised.cost) == (0.0, 1.0)


def test_past_commands_are_carried_on(make_system):
    model, A, B = make_system(2)
    names = model.channels.names
    late = policy_of(np.array([60.0, 12.0, 8.0, -0.3, -0.2]), names)
    start = Gaussian(np.append(START.mean, [0, 0]), np.diag([0.01, 0.02, 0.01, 0, 0]) ** 2)
    cost = SaturatingCost(np.zeros(5), np.array([0.25, 2.5, 1.0, np.inf, np.inf]))
    expected = np.abs(np.linalg.eigvals(A + np.outer(B, late.gain * 30.0))).max() < 1.0
    assert expected
    assert validate(model, late, cost, start, VALIDATION, 0).success == 1.0


@pytest.mark.parametrize(("settled_tilt_limit", "success"), [(0.17, 0.0), (0.5, 1.0)])
def test_a_robot_must_have_settled(make_system, settled_tilt_limit, success):
    model, _, _ = make_system()  # left alone it falls from 0.05 to about 0.23 in 15 steps
    rule = SuccessCriterion(tilt_limit=0.5, settled_tilt_limit=settled_tilt_limit, settle_step=10, steps=15)
    start = Gaussian(np.array([-0.05, 0.0, 0.0]), 1e-8 * np.eye(3))
    assert validate(model, policy_of(np.zeros(3)), COST, start, Validation(20, 100, rule), 0).success == success


def test_a_policy_that_commands_no_number_drops_every_robot(make_system):
    model, _, _ = make_system()
    broken = policy_of(np.array([np.nan, 0.0, 0.0]))
    verdict = validate(model, broken, COST, START, VALIDATION, seed=0)
    assert verdict.success == 0.0
    assert verdict.cost > 0.9


def test_a_state_without_tilt_is_refused_by_name(make_system):
    model, _, _ = make_system()
    blind = replace(model, channels=Channels(("yaw_rate", "tilt_rate", "speed"), 0.15))
    with pytest.raises(ConfigError, match="has no tilt"):
        validate(blind, policy_of(HOLDING, blind.channels.names), COST, START, VALIDATION, seed=0)


def test_a_corrected_probability_falls_to_nothing_where_no_robot_succeeds():
    """As measured: 0.77 at a tenth of the robots; nothing was measured below."""
    reliability = (1.925, 0.39)
    shares = np.linspace(0.0, 1.0, 61)
    found = [success_probability(share, 60, reliability) for share in shares]
    assert found[0] < 0.1 and np.all(np.diff(found) > 0)
    p = (0.5 * 60 + 0.5) / 61
    assert found[30] == pytest.approx(1.0 / (1.0 + np.exp(-1.925 - 0.39 * np.log(p / (1.0 - p)))))
    assert success_probability(0.0, 60) == pytest.approx(0.5 / 61)


@pytest.mark.parametrize(("k", "n"), [(0, 60), (1, 1), (60, 60), (17, 30)])
def test_the_probability_is_the_mean_of_jeffreys_posterior_and_never_certain(k, n):
    grid = (np.arange(200_000) + 0.5) / 200_000  # of the density p^(k - ½) (1 - p)^(n - k - ½), by the midpoint rule
    log_density = (k - 0.5) * np.log(grid) + (n - k - 0.5) * np.log1p(-grid)
    weights = np.exp(log_density - log_density.max())
    found = success_probability(k / n, n)
    assert found == pytest.approx((grid * weights).sum() / weights.sum(), rel=0.01)
    assert 0.0 < found < 1.0
