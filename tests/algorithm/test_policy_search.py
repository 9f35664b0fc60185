"""Of which robots a search knows: those of the sheet, or of a distribution that rollouts made."""

from dataclasses import replace

import numpy as np
import pytest
from falling import PLACED, falls_at_once

from twbal.algorithm.identification import identify
from twbal.algorithm.policy_search import PolicySearch, _calibrated_unknown, recalibrated
from twbal.core.channels import Channels
from twbal.core.cost import cost_over
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.core.errors import ConfigError
from twbal.core.evaluation import SuccessCriterion
from twbal.core.gaussian import Gaussian
from twbal.core.start_pose import StartPose
from twbal.models.dynamics import without_simulation
from twbal.planar.robot_distribution import prior_of
from twbal.policies.rbf import RbfPolicy
from twbal.search import optimise
from twbal.search.margin import Margin
from twbal.search.predicted_rollout import PredictedRollout
from twbal.search.predictor import Predictor
from twbal.search.robust import RobustSettings
from twbal.search.starts import PolicyParametrisation
from twbal.search.task import SearchSettings
from twbal.search.validation import Validation

SUCCESS = SuccessCriterion(tilt_limit=0.5236, settled_tilt_limit=0.1745, settle_step=10, steps=20)
ROBUST = RobustSettings(
    robots=5,
    designs=1,
    screening=2,
    finalists=1,
    width_scales={},
    position_scales=(1.0,),
    change_scales=(1.0,),
    command_widths=(1.0,),
    compensations=(0.0,),
    compensation_tilt=0.015,
    improved=0,
    evaluations=4,
    improving=2,
    enough=0.0,
    doubt=1.0,
    margin=Margin(doubt=0.5, delay=1.0, noise=2.0, push=1.0, push_duration=0.1),
)
SEARCH = SearchSettings(
    horizon=6,
    short_horizon=3,
    iterations=1,
    short_iterations=1,
    restarts=1,
    long_horizon=6,
    long_iterations=0,
    min_success_rate=0.0,
    linearisation_amplitudes=(),
    lqr_command_widths=(),
    gain_scales=(),
    weight_penalty=1e-4,
    particles=0,
    tolerance=1e-5,
    degrees=(2, 4),
)


def find(
    robot,
    known=None,
    names=PLACED,
    robust=ROBUST,
    earlier=(),
    with_margin=False,
    simulated=None,
    set_aside=(),
    searches=True,
    judges=False,
):
    """The result of a search on a model by which nothing changes, and what it said."""
    channels = Channels(names, robot.wheel_radius, robot.control_period)
    widths = {name: 1.0 for name in names if not name.startswith("command")}
    search = PolicySearch(
        channels=channels,
        start=StartPose(-0.17, 0.02, 0.05, 0.02),
        cost=cost_over(names, widths, 1.0, robot.torque_limit),
        shape=PolicyParametrisation(4, True, dict.fromkeys(widths, 0.5), command_scale=0.4, weight_sd=0.05),
        search=SEARCH,
        validation=Validation(robots=2, features=10, success=SUCCESS),
        robot=robot,
        simulated=simulated or {},
        robust=robust,
        seed=0,
        workers=1,
        with_margin=with_margin,
        set_aside=set_aside,
    )
    search = search if searches else search.without_search()
    models, lines = [without_simulation(channels)], []
    if judges:
        return search.judge(models, earlier[0], known, lines.append), lines
    return search.find(models, earlier, None, known, lines.append), lines


@pytest.mark.parametrize(
    ("aside", "searches", "message"),
    [((2,), True, "set_aside has policy 2; there are 1 in initial_policies"), ((0,), False, "set_aside leaves none")],
)
def test_what_cannot_be_set_aside_is_refused(paper, aside, searches, message):
    policy = find(paper)[0].best.policy
    with pytest.raises(ConfigError, match=message):
        find(paper, earlier=[policy], set_aside=aside, searches=searches)


def same(one: RbfPolicy, other: RbfPolicy) -> bool:
    names = ("centres", "weights", "lengths", "gain", "compensation", "bias")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)


def test_without_anything_known_the_sheet_tells_of_the_robots(paper):
    alone, _ = find(paper)
    found, _ = find(paper, prior_of(paper))
    assert same(found.best.policy, alone.best.policy)
    assert found.best.robots.rank == alone.best.robots.rank


def test_what_is_known_decides_for_which_robots_is_searched(paper):
    alone, _ = find(paper)
    found, _ = find(paper, identify(paper, {}, [falls_at_once(paper, 12)], lambda line: None).known)
    assert found.best.robots.rank != alone.best.robots.rank


def test_the_robots_are_those_of_the_simulation_until_rollouts_tell(paper):
    alone, _ = find(paper)
    weak = {"torque_gain": {"gain": 0.5}}
    found, _ = find(paper, simulated=weak)
    assert found.best.robots.rank != alone.best.robots.rank
    given, _ = find(paper, prior_of(paper, weak))
    assert same(found.best.policy, given.best.policy)
    told, _ = find(paper, prior_of(paper), simulated=weak)
    assert told.best.robots.rank == alone.best.robots.rank


def test_what_rollouts_tell_is_refused_where_no_robots_are_asked_for(paper):
    with pytest.raises(ConfigError, match="robust=none asks for none"):
        find(paper, prior_of(paper), robust=None)


def test_regulators_are_sought_anew_only_where_rollouts_tell_of_other_robots(paper):
    first, _ = find(paper)
    (regulator,) = [c.origin for c in first.candidates if c.origin.startswith("regulator of sampled robot")]
    by_sheet, _ = find(paper, earlier=[first.best.policy])
    assert {c.origin for c in by_sheet.candidates} == {"policy 0", "search from policy 0"}
    known = identify(paper, {}, [falls_at_once(paper, 12)], lambda line: None).known
    by_rollouts, _ = find(paper, known, earlier=[first.best.policy])
    assert {c.origin for c in by_rollouts.candidates} == {"policy 0", regulator, f"search from {regulator}"}


@pytest.mark.parametrize(("is_known", "turned", "searches"), [(True, -1.0, 1), (True, 1.0, 2), (False, -1.0, 2)])
def test_a_search_that_loses_the_robots_of_the_rollouts_ends_after_the_short_horizon(
    monkeypatch, paper, is_known, turned, searches
):
    begun = []

    def descend(objective, policy, scales, linear, iterations):
        begun.append(policy)
        return replace(policy, gain=turned * policy.gain)  # driven backwards, every robot falls

    monkeypatch.setattr(optimise, "descend", descend)
    result, _ = find(paper, prior_of(paper) if is_known else None)
    assert result.best.robots.success > 0.0
    assert len(begun) == searches


def test_probabilities_of_success_are_corrected_by_what_tells_of_the_robot(paper):
    robust = replace(ROBUST, reliability_sheet=(-5.0, 0.0), reliability_rollouts=(5.0, 0.0))
    by_sheet, _ = find(paper, robust=robust)
    by_rollouts, _ = find(paper, prior_of(paper), robust=robust)
    by_model, _ = find(paper, robust=None)
    assert by_sheet.best.success_probability == pytest.approx(0.0067, abs=1e-4)
    assert by_rollouts.best.success_probability == pytest.approx(0.9933, abs=1e-4)
    assert by_model.best.success_probability == pytest.approx((2 * by_model.best.judged.success + 0.5) / 3)


@pytest.mark.parametrize(
    ("names", "lacking"),
    [(("tilt", "tilt_rate", "acceleration"), "speed"), (("tilt", "acceleration"), "tilt_rate, speed")],
)
def test_a_state_that_no_regulator_can_take_is_searched_on_the_model_alone(paper, names, lacking):
    found, lines = find(paper, names=names)
    assert found.best.robots is None
    assert lines[0] == f"no robots of the parameter distribution (robust): the state has no {lacking}"
    _, quiet = find(paper, names=names, robust=None)
    assert lines[1:] == quiet


def driven_by(driver, states, trial=0):
    """A rollout with these states by the policy with this hash."""
    observations = np.zeros((len(states), 7))
    observations[:, 0] = 0.02 * np.arange(len(states))
    told = Provenance("paper", "robot", policy_hash=driver, trial=trial)
    return Episode(PLACED, 0.02, observations, states, np.zeros(len(states) - 1), Outcome.COMPLETED, told)


def test_without_rollouts_the_sampled_robots_predict_alone_and_else_all_that_can(paper):
    alone, _ = find(paper)
    assert [each.by for each in alone.predictions] == [Predictor.ROBOTS]
    all_of_them, _ = find(paper, earlier=[alone.best.policy], judges=True)
    assert [each.by for each in all_of_them.predictions[:2]] == [Predictor.ROBOTS, Predictor.MODEL]
    assert [each.crps for each in all_of_them.predictions] == [None] * len(all_of_them.predictions)
    assert len(all_of_them.predictions) > 2
    by_model, _ = find(paper, robust=None)
    assert [each.by for each in by_model.predictions] == [Predictor.MODEL]


@pytest.mark.parametrize("best", [0, 1])
def test_rollouts_of_the_policy_tell_which_prediction_to_take_and_how_wide_it_is(paper, best):
    first, _ = find(paper)
    result, _ = find(paper, earlier=[first.best.policy], judges=True)
    result = result._replace(best=result.best._replace(earlier=0))
    channels = Channels(PLACED, paper.wheel_radius, paper.control_period)
    cost = cost_over(PLACED, {name: 1.0 for name in PLACED if not name.startswith("command")}, 1.0, paper.torque_limit)
    true = result.predictions[best]
    rng = np.random.default_rng(0)
    drawn = [np.array([state.sample(1, rng)[0] for state in true.states]) for _ in range(20)]
    found = recalibrated(result, [driven_by("abc", states) for states in drawn], "abc", channels, cost)
    bare = {"states": (), "crps": None, "unknown": None}
    assert found.predictions[0]._replace(**bare) == true._replace(**bare)
    assert [each.crps for each in found.predictions] == sorted(each.crps for each in found.predictions)
    measured = list(channels.measured)
    for wide, state in zip(found.predictions[0].states[1:], true.states[1:], strict=True):
        assert np.array_equal(wide.mean, state.mean)
        assert (wide.sd[measured] > 0.85 * state.sd[measured]).all()  # the rollouts are as the prediction says


@pytest.mark.parametrize("changed", [{}, {"robust": None}])
def test_margin_without_rollouts_or_sampled_robots_is_refused(paper, changed):
    with pytest.raises(ConfigError, match="give known=<run folder of identify>"):
        find(paper, with_margin=True, **changed)


def test_rollouts_of_another_policy_choose_nothing(paper):
    result, _ = find(paper)
    result = result._replace(best=result.best._replace(earlier=0))
    channels = Channels(PLACED, paper.wheel_radius, paper.control_period)
    cost = cost_over(PLACED, {"tilt": 1.0}, 1.0, paper.torque_limit)
    with pytest.raises(ConfigError, match="another one drove it"):
        recalibrated(result, [driven_by("other", np.zeros((7, len(PLACED))))], "abc", channels, cost)


def test_what_rollouts_add_to_a_band_is_not_known_and_what_they_take_away_leaves_the_shares():
    before = PredictedRollout(Predictor.ROBOTS, 1.0, (Gaussian(np.zeros(2), np.diag([4.0, 1.0])),) * 2)
    before = before._replace(unknown=np.array([[1.0, 0.5], [1.0, 0.5]]))
    wider, narrower = (Gaussian(np.zeros(2), np.diag(each)) for each in ([9.0, 1.0], [1.0, 0.25]))
    found = _calibrated_unknown(before, (wider, narrower))
    np.testing.assert_allclose(found, [[6.0, 0.5], [0.25, 0.125]])
    assert _calibrated_unknown(before._replace(unknown=None), (wider, narrower)) is None
