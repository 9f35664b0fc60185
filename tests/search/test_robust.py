"""Regulators for sampled robots, driven on robots that are known."""

from dataclasses import replace

import numpy as np
import pytest
from sampled import NAMES, SETTINGS, START, WIDTHS, known_to_be, rule_for, sampled_robots

from twbal.algorithm.rollout import rollout
from twbal.core.channels import Channels
from twbal.core.cost import SaturatingCost, cost_over
from twbal.core.episode import Provenance
from twbal.core.errors import ConfigError
from twbal.core.evaluation import judged
from twbal.effects.library import effects_from
from twbal.planar.planar_plant import PlanarPlant
from twbal.planar.robot_distribution import prior_of
from twbal.search.robust import scaled, slow_noise


def successes(robot, policy, effects, trials=4):
    channels, rule = Channels(NAMES, robot.wheel_radius, robot.control_period), rule_for(robot)
    plant = PlanarPlant(
        robot=robot, effects=effects_from(effects), start=START, physics_step=robot.control_period / 20, seed=1
    )
    driven = [
        rollout(plant, policy, channels, rule.steps, rule.tilt_limit, Provenance("paper", "robot", trial=k))
        for k in range(trials)
    ]
    return sum(judged(episode, rule).succeeded for episode in driven)


@pytest.fixture(scope="module")
def sticky(paper):
    """Of a robot with a dead zone of 3 N·m, and dry friction, that is known to have them."""
    known = known_to_be(
        paper, dead_zone_width=3.0, coulomb_friction_torque=0.2, actuation_delay_delay=0.015, com_offset_angle=0.04
    )
    return sampled_robots(paper, known)


@pytest.fixture(scope="module")
def found(sticky):
    return sticky.regulators()


@pytest.mark.parametrize("which", ["paper", "regbot"])
def test_regulators_for_all_that_a_sheet_may_mean_hold_the_robot_that_it_says(request, which):
    robot = request.getfixturevalue(which)
    best = sampled_robots(robot).regulators()[0]
    assert successes(robot, best.policy, {}) == 4


def test_a_robot_that_is_known_to_stick_gets_friction_compensation(paper, found, sticky):
    best = found[0]
    assert best.policy.compensation > 0
    assert best.success > 0.7
    plain = max(sticky.ranked("", replace(each.policy, compensation=0.0)).success for each in found)
    assert best.success > plain
    effects = {
        "dead_zone": {"width": 3.0},
        "coulomb_friction": {"torque": 0.2},
        "actuation_delay": {"delay": 0.015},
        "com_offset": {"angle": 0.04},
    }
    assert successes(paper, best.policy, effects) == 4


def test_the_best_comes_first_and_all_are_judged_on_all_robots(found, sticky):
    assert len(found) == SETTINGS.finalists
    assert [each.shortfall for each in found] == sorted(each.shortfall for each in found)
    for each in found:
        driven = sticky.driven(each.policy)
        assert len(driven.used) == SETTINGS.robots
        assert each.success == (driven.used <= 1.0).mean()
        assert (each.use, each.cost) == (np.maximum(driven.used, driven.swings).mean(), driven.costs.mean())


def test_a_direct_search_makes_robots_use_less_of_the_limits(sticky, found):
    improving = replace(sticky, settings=replace(SETTINGS, improved=1))
    (better,) = (each for each in improving.regulators() if each.origin.endswith("improved"))
    begun, ended = (improving.driven(each.policy, SETTINGS.improving).mean_use for each in (found[0], better))
    assert ended < 0.95 * begun


def test_regulators_that_hold_enough_robots_are_left_as_they_are(sticky, found):
    settled = replace(sticky, settings=replace(SETTINGS, improved=1, enough=found[0].use))
    assert [each.origin for each in settled.regulators()] == [each.origin for each in found]


def test_doubt_spreads_the_drawn_robots(paper):
    prior = prior_of(paper)
    near, far = (prior.models(500, np.random.default_rng(0), doubt) for doubt in (1.0, 2.0))
    angles = np.array([[model.com_offset_angle for model in models] for models in (near, far)])
    np.testing.assert_allclose(angles[1], np.clip(2.0 * angles[0], -0.2, 0.2))


def test_the_same_seed_finds_the_same_to_the_last_bit(paper, sticky, found):
    again = replace(sticky).regulators()
    for one, other in zip(found, again, strict=True):
        assert (one.origin, one.success, one.cost) == (other.origin, other.success, other.cost)
        np.testing.assert_array_equal(one.policy.gain, other.policy.gain)
    others = replace(sticky, seed=1)
    assert not np.array_equal(others.driven(found[0].policy).costs, sticky.driven(found[0].policy).costs)


def test_screening_drives_the_first_of_the_same_robots(sticky, found):
    few, all_of_them = sticky.driven(found[0].policy, 8), sticky.driven(found[0].policy)
    np.testing.assert_array_equal(few.costs, all_of_them.costs[:8])


def test_drawn_robots_have_the_spread_that_is_known_and_none_is_beyond_its_bounds(paper):
    prior = prior_of(paper)
    models = prior.models(4000, np.random.default_rng(0))
    values = np.array([[getattr(model, field) for field in prior.fields] for model in models])
    np.testing.assert_array_equal(values[0], prior.mean)
    assert (values >= prior.low).all() and (values <= prior.high).all()
    free = [prior.fields.index(field) for field in ("com_offset_angle", "body_mass_factor", "com_height_factor")]
    sd = np.sqrt(np.diag(prior.covariance))[free]
    np.testing.assert_allclose(values[:, free].std(axis=0), sd, rtol=0.05)
    np.testing.assert_allclose(values[:, free].mean(axis=0), prior.mean[free], atol=0.07 * sd.max())
    leaning = replace(prior, covariance=prior.covariance.copy())
    k, l = free[1:]
    leaning.covariance[k, l] = leaning.covariance[l, k] = -0.8 * sd[1] * sd[2]
    drawn = leaning.models(4000, np.random.default_rng(1))
    pairs = np.array([[m.body_mass_factor, m.com_height_factor] for m in drawn])
    assert np.corrcoef(pairs.T)[0, 1] == pytest.approx(-0.8, abs=0.05)


def test_other_widths_are_of_named_channels_of_place_and_of_changes(paper):
    channels = Channels(NAMES, 0.15, 0.02)
    cost = cost_over(NAMES, WIDTHS, 1.0, 20.0, 0.3)
    other = scaled(cost, channels, {"speed": 4.0, "position_integral": 3.0, "yaw_rate": 7.0}, 0.5, 2.0)
    assert isinstance(other, SaturatingCost)
    factors = [1.0, 1.0, 4.0, 1.0, 1.0, 0.5, 1.5]
    np.testing.assert_array_equal(other.widths, factors * cost.widths)
    np.testing.assert_array_equal(other.change, 0.5 * cost.change)


@pytest.mark.parametrize("forgotten", [0.02, 0.3])
def test_slow_noise_is_normal_and_its_correlation_fades(forgotten):
    """Of 4000 draws; means and correlations have standard deviations of about 0.016 then."""
    found = slow_noise((4000, 40, 2), forgotten, np.random.default_rng(0))
    np.testing.assert_allclose(found.mean(axis=0), 0.0, atol=0.08)
    np.testing.assert_allclose(found.var(axis=0), 1.0, atol=0.11)
    for k in (1, 5, 20, 39):
        fading = np.mean(found[:, 0] * found[:, k], axis=0)
        np.testing.assert_allclose(fading, np.exp(-k * forgotten), atol=0.1)
        assert np.mean(found[:, k:] * found[:, :-k]) == pytest.approx(np.exp(-k * forgotten), abs=0.03)
    assert abs(np.mean(found[..., 0] * found[..., 1])) < 0.03


def test_a_state_without_speed_is_refused(paper):
    with pytest.raises(ConfigError, match="has no speed"):
        sampled_robots(paper, names=("tilt", "tilt_rate", "command_1")).regulators()
