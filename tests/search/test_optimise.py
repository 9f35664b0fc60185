from dataclasses import replace

import numpy as np
import pytest

from twbal.core.cost import SaturatingCost
from twbal.core.errors import SearchError
from twbal.core.gaussian import Gaussian
from twbal.models.moments.truncation import Truncation
from twbal.search.long_term_cost import long_term_cost
from twbal.search.optimise import _not_driven_twice, _rank, search_policy
from twbal.search.predictor import Predictor
from twbal.search.robust import RankedPolicy
from twbal.search.starts import PolicyParametrisation, linear_policy
from twbal.search.transition import transition_model
from twbal.search.validation import ValidationResult

SCALE = {"tilt": 0.15, "tilt_rate": 0.8, "speed": 0.5}
SHAPE = PolicyParametrisation(8, True, SCALE, command_scale=0.4, weight_sd=0.05)


@pytest.fixture(scope="module")
def search(make_task):
    def run(*models, shape=SHAPE, earlier=(), seed=0, progress=lambda line: None, set_aside=(), **told):
        task = make_task(*models, seed=seed, **told)
        return search_policy(task, shape, 20.0, earlier, progress, set_aside=set_aside)

    return run


@pytest.fixture(scope="module")
def model(make_system):
    return make_system(1, g=0.01, samples=80)[0]


@pytest.fixture(scope="module")
def result(search, model):
    return search(model)


def test_a_policy_that_balances_the_model_and_the_true_system_is_found(make_system, model, result):
    assert result.best.validation.success == 1.0
    assert result.best.cost < 12  # of 40; a robot left to fall costs about 35
    _, A, B = make_system(1)
    x = np.array([-0.17, 0.0, 0.0, 0.0])
    for _ in range(300):
        x = A @ x + B * float(result.best.policy.command(x))
    assert np.abs(x[0]) < 0.02


def test_the_probability_of_success_counts_the_robots_that_decide(result):
    best = result.best
    assert best.success_probability == pytest.approx(20.5 / 21)  # of the 20 of the validation all succeed
    known = RankedPolicy(best.origin, best.policy, success=0.3, use=0.5, cost=0.1)
    assert best._replace(robots=known, sampled=60).success_probability == pytest.approx(18.5 / 61)
    assert best._replace(sampled=0).success_probability is None


def test_starts_of_different_families_are_searched(result):
    families = {candidate.origin.split(" (")[0] for candidate in result.candidates}
    assert families == {"search from regulator", "search from random"}


def test_the_whole_horizon_is_searched_after_the_short_one(search, model, result):
    stopped = {c.origin: c.cost for c in search(model, iterations=1).candidates}
    assert all(c.cost < stopped[c.origin] for c in result.candidates)


def test_candidates_stand_in_the_order_of_their_judgement(result):
    assert result.best is result.candidates[0]
    keys = [(-round(c.validation.success, 1), c.validation.cost) for c in result.candidates]
    assert keys == sorted(keys)


def test_the_prediction_is_of_the_best_policy_as_the_sensors_show_it(make_task, model, result):
    task = make_task(model)
    (predicted,) = result.predictions
    assert predicted.by is Predictor.MODEL
    assert len(predicted.states) == task.settings.horizon + 1
    first = predicted.states[0]
    np.testing.assert_allclose(first.mean, [-0.17, 0, 0, 0])
    sensors = np.diag([*model.observation_noise, 0.0])
    np.testing.assert_allclose(first.covariance, task.start.covariance + sensors)
    states = [Gaussian(seen.mean, seen.covariance - sensors) for seen in predicted.states[1:]]
    expected = long_term_cost(
        transition_model(model),
        result.best.policy,
        task.cost,
        task.start,
        task.settings.horizon,
        Truncation(),
        gradient=False,
    )
    assert sum(task.cost.expected(state).value for state in states) == pytest.approx(expected.value, rel=1e-4)
    assert predicted.cost == result.best.cost


def test_sensors_add_nothing_to_a_position_that_follows_from_the_speed(make_system, make_task):
    """Before the first step there is the start's spread and the sensors' noise; position has neither of its own."""
    model, _, _ = make_system(1, place=True)
    D = len(model.channels.names)
    task = replace(make_task(model), start=Gaussian(np.zeros(D), np.zeros((D, D))))
    task = replace(task, cost=SaturatingCost(np.zeros(D), np.full(D, 0.5)))
    shape = replace(SHAPE, scale={**SCALE, "position": 0.5, "position_integral": 0.5})
    still = linear_policy(shape, model.channels.names, 20.0, np.zeros(D), np.random.default_rng(0))
    expected = np.diag([*model.observation_noise, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(task.predicted(still)[0].covariance, expected, atol=1e-18)


def test_the_same_seed_finds_the_same_policy(search, model, result):
    again = search(model).best.policy
    for name in ("centres", "weights", "lengths", "gain"):
        assert np.array_equal(getattr(again, name), getattr(result.best.policy, name))


def test_earlier_policies_are_judged_beside_the_new_and_win_where_the_search_finds_worse(search, model, result):
    names, lines = model.channels.names, []
    falling = linear_policy(SHAPE, names, 20.0, np.zeros(4), np.random.default_rng(0))
    hurried = {
        "iterations": 1,
        "short_iterations": 1,
        "linearisation_amplitudes": (),
        "restarts": 1,
        "gain_scales": (0.01,),
    }
    found = search(model, **hurried, earlier=[falling, result.best.policy], progress=lines.append)
    assert {"policy 0", "policy 1"} < {c.origin for c in found.candidates}
    assert found.best.origin == "policy 1"
    assert found.best.validation == result.best.validation
    assert len(lines) == len(found.candidates) == 3
    assert lines[1].startswith("policy 1: 100% of ")
    assert lines[1].endswith(f"the learned model expects a cost of {result.best.cost:.2f}")


def test_the_search_goes_on_over_a_longer_horizon_until_enough_sampled_robots_balance(search, model, result):
    hurried = {"iterations": 2, "short_iterations": 2, "long_iterations": 3, "restarts": 1}
    origins = {
        content: [c.origin for c in search(model, **hurried, min_success_rate=content).candidates]
        for content in (0.0, 1.01)
    }
    assert not any(origin.startswith("long") for origin in origins[0.0])
    (more,) = set(origins[1.01]) - set(origins[0.0])
    assert more == f"long {origins[0.0][0]}"


def test_what_runs_away_slowly_is_held_by_the_longer_horizon(search, model):
    """A regulator that lets the speed grow a little at each step costs little over a short horizon."""
    found = search(model, iterations=2, short_iterations=2, min_success_rate=1.01, long_iterations=8)
    by_origin = {c.origin: c.validation.cost for c in found.candidates}
    longer = [origin for origin in by_origin if origin.startswith("long ")]
    assert longer
    assert all(by_origin[origin] <= by_origin[origin.removeprefix("long ")] for origin in longer)


def test_the_papers_plain_network_balances_too(search, make_system):
    model, _, _ = make_system(0, samples=80)
    shape = replace(SHAPE, basis=30, linear=False)
    found = search(model, restarts=1, shape=shape)
    assert found.best.validation.success >= 0.9
    assert not found.best.policy.gain.any()


def test_a_model_without_a_finite_cost_anywhere_is_named(search, make_system):
    model, _, _ = make_system(0, samples=20)
    model.f.weights[:] = np.nan
    with pytest.raises(SearchError, match="None of 1 starting policies has a finite cost"):
        search(model)


def test_what_the_search_finds_beats_its_starts_in_the_validation(make_task, model, result):
    still = linear_policy(SHAPE, model.channels.names, 20.0, np.zeros(4), np.random.default_rng(0))
    verdict = make_task(model).validated("still", still).validation
    assert verdict.success == 0.0
    assert result.best.validation.cost < 0.5 * verdict.cost


@pytest.fixture(scope="module")
def weak_and_strong(model):
    """Two robots about the one that was learned: half and one and a half times the torque."""
    scaled = [replace(model, f=stretched(model.f, share), g=None) for share in (0.5, 1.6)]
    return scaled


def stretched(gp, share):
    """`gp` of a robot whose commands, the past one with them, do `share` of what they did."""
    scale = np.array([1.0, 1.0, 1.0, 1.0 / share, 1.0 / share])
    return replace(gp, centres=gp.centres * scale, length_scales=gp.length_scales * scale)


def test_a_policy_for_two_robots_holds_both_where_one_for_either_does_not(search, make_task, weak_and_strong):
    both = make_task(*weak_and_strong)
    for_both = search(*weak_and_strong).best
    assert for_both.validation.success == 1.0
    for robot in weak_and_strong:
        assert make_task(robot).validated("", for_both.policy).validation.success == 1.0
        for_one = search(robot).best.policy
        assert both.validated("", for_one).cost > for_both.cost


def test_several_models_cost_their_mean_and_so_does_their_gradient(make_task, weak_and_strong, result):
    policy, task = result.best.policy, make_task(*weak_and_strong)
    found = task.objective(20).cost_of(policy, gradient=True)
    each = [make_task(robot).objective(20).cost_of(policy, gradient=True) for robot in weak_and_strong]
    assert found.value == pytest.approx(np.mean([one.value for one in each]), rel=1e-12)
    assert found.value == pytest.approx(task.objective(20).value(policy), rel=1e-12)
    for name in ("centres", "weights", "lengths", "gain"):
        mean = np.mean([getattr(one.gradient, name) for one in each], axis=0)
        np.testing.assert_allclose(getattr(found.gradient, name), mean, rtol=1e-12)


def test_what_several_models_predict_is_their_mixture(make_task, weak_and_strong, result):
    """Against states drawn from one model or the other, by chance."""
    policy, rng = result.best.policy, np.random.default_rng(0)
    mixture = make_task(*weak_and_strong).predicted(policy)[30]
    ones = [make_task(robot).predicted(policy)[30] for robot in weak_and_strong]
    drawn = np.concatenate([one.sample(20000, rng) for one in ones])
    np.testing.assert_allclose(mixture.mean, drawn.mean(axis=0), atol=4 * mixture.sd.max() / 200)
    np.testing.assert_allclose(mixture.covariance, np.cov(drawn.T), atol=0.05 * np.max(mixture.covariance))


def test_candidates_whose_judgement_is_no_number_come_last(result):
    broken = [result.best._replace(validation=ValidationResult(*values)) for values in ((1.0, np.nan), (np.nan, 0.1))]
    for order in ([*broken, result.best], [result.best, *broken], [broken[0], result.best, broken[1]]):
        assert sorted(order, key=_rank)[0] is result.best


def test_an_earlier_policy_that_is_set_aside_is_no_candidate(search, model, result):
    earlier = [result.best.policy, replace(result.best.policy, bias=0.01)]
    found = search(model, earlier=earlier, set_aside=[0])
    assert {each.earlier for each in found.candidates} == {1, None}


def test_policies_that_differ_in_friction_compensation_or_bias_are_not_the_same():
    names, gain = ("tilt", "tilt_rate"), np.array([1.0, 0.2])
    plain = linear_policy(SHAPE, names, 20.0, gain, np.random.default_rng(0))
    jumping, leaning = replace(plain, compensation=0.1), replace(plain, bias=0.01)
    assert _not_driven_twice([plain, jumping, leaning]) == [0, 1, 2]
    assert _not_driven_twice([plain, jumping, replace(plain), leaning, replace(leaning)]) == [1]
