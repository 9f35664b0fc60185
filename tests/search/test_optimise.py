from dataclasses import replace

import numpy as np
import pytest

from twbal.cost import SaturatingCost
from twbal.errors import SearchError
from twbal.evaluation import SuccessRule
from twbal.gaussian import Gaussian
from twbal.models.moments.prediction import Truncation
from twbal.search.judgement import Judge, judge
from twbal.search.long_term_cost import long_term_cost
from twbal.search.optimise import SearchSettings, search_policy
from twbal.search.starts import PolicyShape, linear_policy
from twbal.search.transition import transition_model

SETTINGS = SearchSettings(
    horizon=40,
    short_horizon=15,
    iterations=12,
    short_iterations=8,
    searched=2,
    long_horizon=80,
    long_iterations=4,
    content=0.0,
    swings=(0.3,),
    command_widths=(1.0, 0.3),
    shares=(1.0, 0.5),
    weight_penalty=1e-4,
    particles=0,
    tolerance=1e-5,
    degrees=(2, 4),
)
SCALE = {"tilt": 0.15, "tilt_rate": 0.8, "speed": 0.5}
SHAPE = PolicyShape(8, True, SCALE, past_command_scale=0.4, weight_sd=0.05)
JUDGE = Judge(robots=20, features=60, rule=SuccessRule(limit=0.5236, settle_limit=0.1745, settle_step=60, steps=150))
WIDTHS = np.array([0.25, 2.5, 1.0, 20.0])
START_SD = np.array([0.02, 0.05, 0.02, 0.0])


def search(model, settings=SETTINGS, shape=SHAPE, earlier=(), seed=0, progress=lambda line: None):
    D = len(model.channels.names)
    start = Gaussian(np.array([-0.17, 0.0, 0.0, 0.0])[:D], np.diag(START_SD[:D]) ** 2)
    cost = SaturatingCost(np.zeros(D), WIDTHS[:D])
    return search_policy(model, start, cost, shape, 20.0, settings, JUDGE, earlier, seed, progress)


@pytest.fixture(scope="module")
def model(make_system):
    return make_system(1, g=0.01, samples=80)[0]


@pytest.fixture(scope="module")
def result(model):
    return search(model)


def test_a_policy_that_balances_the_model_and_the_true_system_is_found(make_system, model, result):
    assert result.best.judgement.success == 1.0
    assert result.best.cost < 12  # of 40; a robot left to fall costs about 35
    _, A, B = make_system(1)
    x = np.array([-0.17, 0.0, 0.0, 0.0])
    for _ in range(300):
        x = A @ x + B * float(result.best.policy.command(x))
    assert np.abs(x[0]) < 0.02


def test_starts_of_different_families_are_searched(result):
    families = {candidate.origin.split(" (")[0] for candidate in result.candidates}
    assert families == {"search from regulator", "search from random"}


def test_the_whole_horizon_is_searched_after_the_short_one(model, result):
    stopped = {c.origin: c.cost for c in search(model, replace(SETTINGS, iterations=1)).candidates}
    assert all(c.cost < stopped[c.origin] for c in result.candidates)


def test_candidates_stand_in_the_order_of_their_judgement(result):
    assert result.best is result.candidates[0]
    keys = [(-round(c.judgement.success, 1), c.judgement.cost) for c in result.candidates]
    assert keys == sorted(keys)


def test_the_prediction_is_of_the_best_policy_as_the_sensors_show_it(model, result):
    assert len(result.predicted) == SETTINGS.horizon + 1
    first = result.predicted[0]
    np.testing.assert_allclose(first.mean, [-0.17, 0, 0, 0])
    np.testing.assert_allclose(np.diag(first.covariance), START_SD**2 + [*model.observation_noise, 0.0])
    cost = SaturatingCost(np.zeros(4), WIDTHS)
    sensors = np.diag([*model.observation_noise, 0.0])
    states = [Gaussian(seen.mean, seen.covariance - sensors) for seen in result.predicted[1:]]
    start = Gaussian(first.mean, first.covariance - sensors)
    expected = long_term_cost(
        transition_model(model), result.best.policy, cost, start, SETTINGS.horizon, Truncation(), gradient=False
    )
    assert sum(cost.expected(state).value for state in states) == pytest.approx(expected.value, rel=1e-4)


def test_the_same_seed_finds_the_same_policy(model, result):
    again = search(model).best.policy
    for name in ("centres", "weights", "lengths", "gain"):
        assert np.array_equal(getattr(again, name), getattr(result.best.policy, name))


def test_earlier_policies_are_judged_beside_the_new_and_win_where_the_search_finds_worse(model, result):
    names, lines = model.channels.names, []
    falling = linear_policy(SHAPE, names, 20.0, np.zeros(4), np.random.default_rng(0))
    hurried = replace(SETTINGS, iterations=1, short_iterations=1, swings=(), searched=1, shares=(0.01,))
    found = search(model, hurried, earlier=[falling, result.best.policy], progress=lines.append)
    assert {"policy 0", "policy 1"} < {c.origin for c in found.candidates}
    assert found.best.origin == "policy 1"
    assert found.best.judgement == result.best.judgement
    assert len(lines) == len(found.candidates) == 3
    assert lines[1].startswith(f"policy 1: cost {result.best.cost:.2f}, 100%")


def test_the_search_goes_on_over_a_longer_horizon_until_the_judge_is_content(model, result):
    hurried = replace(SETTINGS, iterations=2, short_iterations=2, long_iterations=3, searched=1)
    origins = {
        content: [c.origin for c in search(model, replace(hurried, content=content)).candidates]
        for content in (0.0, 1.01)
    }
    assert not any(origin.startswith("long") for origin in origins[0.0])
    (more,) = set(origins[1.01]) - set(origins[0.0])
    assert more == f"long {origins[0.0][0]}"


def test_what_runs_away_slowly_is_held_by_the_longer_horizon(model):
    """A regulator that lets the speed grow a little at each step costs little over a short horizon."""
    found = search(model, replace(SETTINGS, iterations=2, short_iterations=2, content=1.01, long_iterations=8))
    by_origin = {c.origin: c.judgement.cost for c in found.candidates}
    longer = [origin for origin in by_origin if origin.startswith("long ")]
    assert longer
    assert all(by_origin[origin] <= by_origin[origin.removeprefix("long ")] for origin in longer)


def test_the_papers_plain_network_balances_too(make_system):
    model, _, _ = make_system(0, samples=80)
    shape = replace(SHAPE, basis=30, linear=False)
    found = search(model, replace(SETTINGS, searched=1), shape)
    assert found.best.judgement.success >= 0.9
    assert not found.best.policy.gain.any()


def test_a_model_without_a_finite_cost_anywhere_is_named(make_system):
    model, _, _ = make_system(0, samples=20)
    model.f.weights[:] = np.nan
    with pytest.raises(SearchError, match="None of 1 starting policies has a finite cost"):
        search(model)


def test_what_the_search_finds_beats_its_starts_in_the_judges_eyes(model, result):
    still = linear_policy(SHAPE, model.channels.names, 20.0, np.zeros(4), np.random.default_rng(0))
    start = Gaussian(np.array([-0.17, 0.0, 0.0, 0.0]), np.diag(START_SD) ** 2)
    verdict = judge(model, still, SaturatingCost(np.zeros(4), WIDTHS), start, JUDGE, 0)
    assert verdict.success == 0.0
    assert result.best.judgement.cost < 0.5 * verdict.cost
