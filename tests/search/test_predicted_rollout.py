"""Predictions of rollouts, against rollouts of the plant behind the seam, and the choice between them."""

from dataclasses import replace

import numpy as np
import pytest
from sampled import NAMES, START, known_to_be, rule_for, sampled_robots

from twbal.algorithm.rollout import rollout
from twbal.core.channels import Channels
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.core.evaluation import real_cost
from twbal.core.gaussian import Gaussian
from twbal.effects.library import effects_from
from twbal.planar.planar_plant import PlanarPlant
from twbal.planar.robot_distribution import prior_of
from twbal.search.predicted_rollout import PredictedRollout, predicted_by_robots, ranked_by_crps
from twbal.search.predictor import Predictor

HORIZON = 60
QUIET = {"sensor_sd": np.zeros(4), "torque_sd": np.zeros(2), "filter_rate": (0.0, 0.0)}


def trials_of(robot, policy, effects, number, steps=HORIZON):
    """Rollouts of a planar plant with these effects by a policy."""
    channels, rule = Channels(NAMES, robot.wheel_radius, robot.control_period), rule_for(robot)
    plant = PlanarPlant(robot=robot, effects=effects_from(effects), start=START, physics_step=0.001, seed=5)
    return [
        rollout(plant, policy, channels, steps, rule.tilt_limit, Provenance("paper", "robot", trial=k))
        for k in range(number)
    ]


@pytest.fixture(scope="module")
def sticky(paper):
    """Robots that are known to have a dead zone and a delay, without noise, all alike."""
    known = replace(prior_of(paper), **QUIET)
    mean = np.array(known.mean)
    for field, value in (("dead_zone_width", 2.0), ("actuation_delay_delay", 0.012)):
        mean[known.fields.index(field)] = value
    return sampled_robots(paper, replace(known, mean=mean, covariance=1e-12 * known.covariance), robots=60)


@pytest.fixture(scope="module")
def effects(sticky):
    """Of the robot that has the mean of the parameters."""
    mean = dict(zip(sticky.distribution.fields, sticky.distribution.mean, strict=True))
    return {
        "dead_zone": {"width": mean["dead_zone_width"]},
        "actuation_delay": {"delay": mean["actuation_delay_delay"]},
        "viscous_friction": {"coefficient": mean["viscous_friction_coefficient"]},
        "coulomb_friction": {"torque": mean["coulomb_friction_torque"]},
        "rotor_inertia": {"share": mean["rotor_inertia_share"]},
    }


@pytest.fixture(scope="module")
def policy(paper):
    return sampled_robots(paper, known_to_be(paper, dead_zone_width=2.0, actuation_delay_delay=0.012)).regulators()[0]


def test_robots_that_are_known_predict_the_trials_of_a_plant(paper, sticky, effects, policy):
    """Their mean course and cost are those of many trials; what differs is the draw of the starts."""
    trials = trials_of(paper, policy.policy, effects, 60)
    first = next(predicted_by_robots(sticky, policy.policy, HORIZON))
    costs = [real_cost(trial, sticky.cost, HORIZON) for trial in trials]
    error = np.std(costs) * np.sqrt(2.0 / len(costs))
    assert first.cost == pytest.approx(np.mean(costs), abs=4.0 * error)
    assert error < 0.1 * np.mean(costs)
    shown = np.array([trial.states for trial in trials])  # (n, H + 1, D)
    means = np.array([state.mean for state in first.states])
    # Wheel rates of the robots are up to half a control period older, as those of encoders are.
    assert (np.abs(means - shown.mean(axis=0)).mean(axis=0) < 0.05 * np.ptp(shown, axis=(0, 1))).all()


def test_a_robot_that_falls_costs_one_a_step_from_there_and_is_in_no_state(sticky, policy):
    backwards = replace(policy.policy, gain=-policy.policy.gain)
    predicted = next(predicted_by_robots(sticky, backwards, HORIZON))
    fallen = np.isnan(sticky.states(backwards, HORIZON)[..., 0])
    assert fallen[:, -1].all()
    assert not fallen[:, 1].any()
    standing = (~fallen[:, 1:]).sum(axis=1).mean()
    assert HORIZON - standing < predicted.cost < HORIZON
    last = int((~fallen).sum(axis=0).nonzero()[0].max())
    assert predicted.states[-1] is predicted.states[last]
    assert np.isfinite([state.mean for state in predicted.states]).all()


def test_robots_are_driven_as_the_search_drives_them_first(paper, policy):
    """Over the rule's whole time, with the same draws, so the costs are the same."""
    robots = sampled_robots(paper)
    steps = robots.rule.steps
    first = next(predicted_by_robots(robots, policy.policy, steps))
    assert (first.by, first.detail) == (Predictor.ROBOTS, "")
    assert first.cost == pytest.approx(steps * robots.driven(policy.policy).costs.mean(), rel=1e-9)


def test_the_others_have_less_spread_and_smaller_torques(paper, policy):
    details = [each.detail for each in predicted_by_robots(sampled_robots(paper), policy.policy, HORIZON)]
    assert details == [
        "",
        "slow torques x 0.5",
        "slow torques x 0.25",
        "mean parameters",
        "mean parameters, slow torques x 0.5",
        "mean parameters, slow torques x 0.25",
    ]
    known = known_to_be(paper)
    by = {
        each.detail: np.sum([state.sd[0] for state in each.states])
        for each in predicted_by_robots(sampled_robots(paper, known), policy.policy, HORIZON)
    }
    assert by["slow torques x 0.25"] < by["slow torques x 0.5"] < by[""]
    assert by["mean parameters"] < by[""]


def test_the_same_seed_predicts_the_same(paper, policy):
    one, other = (list(predicted_by_robots(sampled_robots(paper), policy.policy, HORIZON))[1] for _ in range(2))
    assert one.cost == other.cost
    assert all(np.array_equal(a.covariance, b.covariance) for a, b in zip(one.states, other.states, strict=True))


def course(states):
    observations = np.zeros((len(states), 7))
    observations[:, 0] = 0.02 * np.arange(len(states))
    driven = Provenance("paper", "robot")
    return Episode(("tilt", "speed"), 0.02, observations, states, np.zeros(len(states) - 1), Outcome.COMPLETED, driven)


def normal(by, mean, sd):
    return PredictedRollout(by, 3.0, tuple(Gaussian(np.full(2, mean), sd**2 * np.eye(2)) for _ in range(41)))


@pytest.mark.parametrize("best", [0, 1, 2])
def test_the_prediction_that_the_rollouts_were_drawn_from_comes_first(best):
    bands = [(0.0, 0.1), (0.0, 1.0), (0.5, 0.3)]
    rng = np.random.default_rng(best)
    mean, sd = bands[best]
    episodes = [course(mean + sd * rng.standard_normal((41, 2))) for _ in range(3)]
    predictions = [normal(Predictor.MODEL, *band) for band in bands]
    ranked = ranked_by_crps(predictions, episodes, [0, 1], np.ones(2))
    assert ranked[0].states is predictions[best].states
    assert [each.crps for each in ranked] == sorted(each.crps for each in ranked)


def test_where_no_channel_has_a_scale_the_order_stays():
    predictions = [normal(Predictor.MODEL, 0.0, 9.0), normal(Predictor.ROBOTS, 0.0, 1.0)]
    ranked = ranked_by_crps(predictions, [course(np.zeros((41, 2)))], [0, 1], np.full(2, np.inf))
    assert [each.by for each in ranked] == [Predictor.MODEL, Predictor.ROBOTS]
    assert [each.crps for each in ranked] == [None, None]


@pytest.mark.slow
def test_without_noise_all_of_the_variance_that_starts_do_not_make_is_not_known(paper, policy):
    """The same robots under many more draws tell the variance of their means."""
    robots = sampled_robots(paper, known_to_be(paper, spread=0.5, dead_zone_width=2.0), robots=400)
    predicted = next(predicted_by_robots(robots, policy.policy, HORIZON))
    series = [robots.states(policy.policy, HORIZON)]
    with pytest.MonkeyPatch.context() as patch:
        for number in range(10, 30):
            patch.setattr("twbal.search.robust._AGAIN", number)
            series.append(robots.states(policy.policy, HORIZON, again=True))
    means = np.mean(series, axis=0)  # (n, H + 1, D), NaN of those that fell in one of them
    within = np.nanmean(np.var(series, axis=0, ddof=1), axis=0) / len(series)
    between = np.nanvar(means, axis=0) - within
    tilt = NAMES.index("tilt")
    assert predicted.unknown[10:, tilt].sum() == pytest.approx(between[10:, tilt].sum(), rel=0.3)
    total = sum(state.sd[tilt] ** 2 for state in predicted.states[10:])
    assert 0.05 < predicted.unknown[10:, tilt].sum() / total < 0.95


def test_little_is_unknown_of_robots_that_are_all_alike(sticky, policy):
    """What is left is how old their wheel rates are, and the error of 400 samples."""
    noisy = replace(sticky.distribution, sensor_sd=np.array([0.003, 0.02, 0.001, 0.05]))
    robots = replace(sticky, distribution=noisy)
    many = replace(robots, settings=replace(robots.settings, robots=400))
    predicted = list(predicted_by_robots(many, policy.policy, 30))
    variance = np.array([state.sd**2 for state in predicted[0].states])
    share = predicted[0].unknown[1:].sum(axis=0) / variance[1:].sum(axis=0)
    assert (share[: NAMES.index("command_1")] < 0.2).all()
