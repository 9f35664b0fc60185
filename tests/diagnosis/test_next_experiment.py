"""The suggested experiment: what it is expected to separate, by closed forms and Monte Carlo, and what is safe."""

from dataclasses import replace
from itertools import chain

import numpy as np
import pytest
from hydra import compose
from hydra.utils import instantiate
from synthetic_recordings import synthetic_recording

from twbal.cli.composition import composing
from twbal.core.streams import Stream, generator
from twbal.diagnosis.advice import on_next_experiment
from twbal.diagnosis.candidates import always_free
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.experiments import Experiment, SimulatedExperiment, experiments_of, simulate
from twbal.diagnosis.follow_up import NextExperiment
from twbal.diagnosis.hypothesis import fit_hypothesis
from twbal.diagnosis.model_comparison import ModelComparison, RivalModel, is_open
from twbal.diagnosis.next_experiment import next_experiment
from twbal.diagnosis.record import ProbableEffect, Rival, Verdict
from twbal.diagnosis.separation import divergences, expected_probability, expected_separation, prior_of, projected
from twbal.diagnosis.verdict import Tempering
from twbal.planar.parameters import planar_parameters
from twbal.sysid.likelihood import whiten
from twbal.sysid.model import Data, Model
from twbal.sysid.noise import NoiseModel
from twbal.sysid.prediction_error_fit import descend

NOISE = NoiseModel(np.array([0.0035, 0.02, 0.001, 0.05]), np.array([0.02, 0.02]))
RIVALS = ("coulomb_friction", "viscous_friction")


def settings():
    with composing():
        return instantiate(compose("diagnose", ["episodes=e"]).diagnosis)


@pytest.fixture(scope="module")
def comparison(paper):
    """Two seconds of a robot with a little Coulomb friction, explained by that, or by viscous friction."""
    recording = synthetic_recording(paper, {"coulomb_friction": {"torque": 0.05}}, seed=5, periods=100)
    data = Data([recording], 5)
    always = always_free(settings().tolerances, planar_parameters(paper, {}), 1)
    rivals = []
    for name in RIVALS:
        (candidate,) = [c for c in candidates_for(paper) if c.name == name]
        fitted = fit_hypothesis(data, Model(planar_parameters(paper, {}), 0.0, NOISE), always, [candidate], 2)
        rivals.append(RivalModel((name,), fitted.fit, 0.5))
    base = fit_hypothesis(data, Model(planar_parameters(paper, {}), 0.0, NOISE), always, [], 2).fit
    return ModelComparison(data, fitted, tuple(rivals), (), Tempering(1.0, 0.0, 0.0), {}, base)


def test_a_model_that_may_adapt_keeps_what_no_change_of_it_makes_up_for():
    """Of a distance with a part along the slopes, the least-squares problem of the definition leaves as much."""
    rng = np.random.default_rng(0)
    J, root = rng.normal(size=(30, 3)), rng.normal(size=(3, 3))
    distance = rng.normal(size=30)
    stacked, aims = np.vstack([J, root]), np.concatenate([-distance, np.zeros(3)])
    _, left, *_ = np.linalg.lstsq(stacked, aims, rcond=None)
    assert projected(distance, J, root.T @ root) == pytest.approx(0.5 * left[0])
    made_up = J @ [1.0, -2.0, 0.5]
    assert projected(made_up, J, 1e-12 * np.eye(3)) < 1e-8 * (made_up @ made_up)
    assert projected(distance, 0.0 * J, np.eye(3)) == pytest.approx(0.5 * distance @ distance)


def test_the_separation_is_the_mean_over_pairs_drawn_by_their_probabilities():
    found = np.array([[0.0, 3.0, 5.0], [1.0, 0.0, 2.0], [4.0, 6.0, 0.0]])
    p = np.array([0.6, 0.3, 0.1])
    rng = np.random.default_rng(1)
    pairs = rng.choice(3, size=(200_000, 2), p=p)
    different = pairs[pairs[:, 0] != pairs[:, 1]]
    drawn = found[different[:, 0], different[:, 1]].mean()
    assert expected_separation(found, p) == pytest.approx(drawn, rel=0.01)


def test_the_true_model_is_expected_to_be_as_likely_as_bayes_rule_has_it():
    """Two models: after an experiment that separates them by D, the true one has 1 / (1 + q/p exp(-D / T))."""
    apart = np.array([[0.0, 3.0], [5.0, 0.0]])
    p, q = 0.7, 0.3
    expected = p / (1.0 + q / p * np.exp(-3.0 / 2.0)) + q / (1.0 + p / q * np.exp(-5.0 / 2.0))
    assert expected_probability(apart, [p, q], 2.0) == pytest.approx(expected)
    assert expected_probability(np.zeros((2, 2)), [p, q], 2.0) == pytest.approx(p**2 + q**2)  # it tells nothing
    one_pair = np.array([[0.0, 1e6, 0.1], [1e6, 0.0, 0.1], [0.1, 0.1, 0.0]])
    all_pairs = 3.0 * (1.0 - np.eye(3))
    thirds = [1 / 3] * 3
    assert expected_probability(one_pair, thirds, 1.0) < expected_probability(all_pairs, thirds, 1.0)
    assert expected_probability(np.where(apart > 4.0, np.nan, apart), [p, q], 1.0) == 0.0


def test_nothing_is_expected_where_one_model_is_certain_or_predictions_are_no_numbers():
    apart = np.array([[0.0, 3.0], [5.0, 0.0]])
    assert expected_separation(apart, [1.0, 0.0]) == 0.0
    assert expected_separation(np.where(apart > 4.0, np.nan, apart), [0.5, 0.5]) == 0.0


def test_the_divergence_is_the_mean_log_likelihood_ratio_of_data_that_one_of_them_makes(paper, comparison):
    """By Monte Carlo over the sensors' noise, both models being as they are (a prior that lets nothing move).

    The likelihood's tails, heavier than those of this noise, make the former about a quarter more.
    """
    experiment = Experiment(0.1, 0.03, 0.06, 0.2)
    true = comparison.rivals[0].fit.model._replace(noise=NOISE)
    other = true.put({"coulomb_friction_torque": 1.4 * true.value("coulomb_friction_torque")})
    priors = [prior_of(comparison.data, comparison.rivals[0].fit)] * 2
    priors = [prior._replace(curvature=1e12 * np.diag(np.diag(prior.curvature))) for prior in priors]
    ratios, expected = [], []
    for seed in range(12):
        data = replace(comparison.data, recordings=[simulate(experiment, paper, true, comparison.data, seed).recording])
        costs = [float(np.sum(data.white(model, data.filter(true)) ** 2)) for model in (true, other)]
        ratios.append(0.5 * (costs[1] - costs[0]))
        expected.append(divergences(data, [true, other], priors)[0, 1])
    error = np.std(ratios) / np.sqrt(len(ratios))
    assert np.mean(ratios) > 10.0 * error
    assert np.mean(expected) == pytest.approx(1.22 * np.mean(ratios), abs=3.0 * error)


def test_a_fit_to_the_new_data_as_well_ends_where_the_linear_one_does(paper, comparison):
    """The gain of fitting the other model to both recordings is that of the closed form."""
    true, other = (c.fit._replace(model=c.fit.model._replace(noise=NOISE)) for c in comparison.rivals)
    path = simulate(Experiment(0.1, 0.005, 0.01, 0.05), paper, true.model, comparison.data, 0).recording
    new = replace(comparison.data, recordings=[path])
    priors = [prior_of(comparison.data, rival.fit) for rival in comparison.rivals]
    found = divergences(new, [true.model, other.model], priors)[0, 1]
    both = replace(comparison.data, recordings=[*comparison.data.recordings, path])
    model = other.model._replace(noise=true.model.noise)
    kalman = both.filter(model)
    before = descend(comparison.data, model, kalman, other.free_parameters, 20)
    after = descend(both, before.model, kalman, other.free_parameters, 20)
    own = float(np.sum(new.white(true.model, new.filter(true.model)) ** 2))
    assert found == pytest.approx(0.5 * (after.cost - before.cost - own), rel=0.5)


def test_a_simulated_recording_is_driven_by_the_law_of_the_policy(paper, comparison):
    """Asked for the command of each measurement, the policy's own controller gives what the recording has."""
    experiment = Experiment(0.1, 0.03, 0.06, 0.2)
    model = comparison.rivals[0].fit.model._replace(noise=NOISE)
    recording = simulate(experiment, paper, model, comparison.data, 3).recording
    controller = experiment.policy(paper).controller(generator(Stream.EXPLORATION, 3))
    tilt, rate, _, wheel_rate = recording.measured[:-1].T
    states = np.stack([tilt, rate, paper.wheel_radius * (wheel_rate + rate)], axis=1)
    np.testing.assert_allclose(recording.commands, [controller(state) for state in states], rtol=1e-12, atol=1e-12)
    assert np.std(recording.commands) > 0.1


def test_a_simulated_recording_leaves_its_own_model_nothing_but_noise(paper, comparison):
    model = comparison.rivals[0].fit.model._replace(noise=NOISE)
    recording = simulate(Experiment(0.1, 0.03, 0.06, 0.2), paper, model, comparison.data, 3).recording
    data = replace(comparison.data, recordings=[recording])
    kalman = data.filter(model)
    (errors,) = data.errors(model, kalman)
    white = whiten(errors, recording.usable, kalman.whiteners, 4)[50:]
    assert np.abs(white.mean(axis=0)).max() < 0.3
    assert np.sqrt((white**2).mean(axis=0)).max() < 1.2


def test_the_strongest_safe_disturbance_separates_two_frictions_more_than_a_repetition(paper, comparison):
    found = next_experiment(comparison, paper)
    assert found.settings["policy.prbs"] > 0.0
    assert found.separation > found.repetition > 0.0
    assert found.is_decisive
    assert found.rivals == (("coulomb_friction",), ("viscous_friction",))


@pytest.mark.slow
def test_nothing_is_offered_in_which_one_of_the_sets_falls(paper, comparison):
    """Motors of a fifth of their torque, and a delay of 60 ms, let no regulator of the data sheet stand."""
    weak = comparison.rivals[1].fit
    model = weak.model.put({"actuation_delay_delay": 0.2, "torque_gain_gain": 0.2})
    falling = comparison._replace(rivals=(comparison.rivals[0], RivalModel((), weak._replace(model=model), 0.01)))
    assert not simulate(experiments_of(paper)[0][0], paper, model, comparison.data, 0).is_safe
    assert next_experiment(falling, paper) is None
    (said, *by_hand) = on_next_experiment(None, falling, [ProbableEffect("dead_zone", 0.6, False, {}, (), "By hand.")])
    assert "near falling" in said
    assert by_hand == ["By hand."]


@pytest.mark.parametrize(
    ("most_tilt", "cut", "safe"), [(0.2, 0.0, True), (0.4, 0.0, False), (0.2, 0.1, False), (np.inf, 0.0, False)]
)
def test_a_robot_that_comes_near_falling_or_meets_its_limit_is_not_safe(comparison, most_tilt, cut, safe):
    assert SimulatedExperiment(comparison.data.recordings[0], most_tilt, cut).is_safe is safe


@pytest.mark.parametrize("robot", ["paper", "regbot", "esp32", "balboa"])
def test_the_command_drives_the_robot_by_the_policy_that_was_simulated(robot):
    with composing():
        sheet = instantiate(compose("real_rollout", ["experiment=excite", f"robot={robot}"]).robot)
        for experiment in chain(*experiments_of(sheet)):
            words = [f"{key}={value}" for key, value in experiment.settings(sheet.control_period).items()]
            cfg = compose("real_rollout", ["experiment=excite", f"robot={robot}", *words])
            told, simulated = instantiate(cfg.policy), experiment.policy(sheet)
            for name in ("gain", "multisine", "prbs", "speed", "fade_tilt", "max_command", "control_period"):
                assert getattr(told, name) == getattr(simulated, name)
            assert cfg.steps * sheet.control_period == pytest.approx(10.0, abs=sheet.control_period)


def test_what_other_effects_do_as_well_is_open_unless_no_sensor_tells_them_apart():
    named = ProbableEffect("com_offset", 1.0, True, {}, ("imu_mount_angle",), "")
    sure, unsure = ([Rival((), 0.0, p, 1.0), Rival(("dead_zone",), 1.0, 1.0 - p, 1.0)] for p in (0.05, 0.4))
    assert not is_open(Verdict.NAMED, [named], sure)
    assert is_open(Verdict.NAMED, [named], unsure)
    same = [Rival((name,), 1.0, 0.5, 1.0) for name in ("com_offset", "imu_mount_angle")]
    assert not is_open(Verdict.NAMED, [named], same)
    assert is_open(Verdict.NAMED, [replace(named, equivalents=("imu_mount_angle", "ground_slope"))], sure)
    assert is_open(Verdict.UNDECIDED, [], sure)
    larger = [Rival(("com_offset",), 1.0, 0.6, 1.0), Rival(("com_offset", "dead_zone"), 0.9, 0.3, 1.0)]
    assert is_open(Verdict.NAMED, [named], larger)
    assert not is_open(Verdict.NAMED, [named], [larger[0], larger[1]._replace(negligible=("dead_zone",))])
    assert not is_open(Verdict.NONE, [replace(named, is_named=False, equivalents=("ground_slope",))], sure)


@pytest.mark.parametrize(
    ("separation", "repetition", "told"), [(9.0, 1.0, False), (9.0, 20.0, False), (0.5, 0.1, True)]
)
def test_what_to_do_by_hand_is_said_where_no_experiment_would_decide(comparison, separation, repetition, told):
    found = NextExperiment({}, 10.0, separation, repetition, (), 0)
    advice = on_next_experiment(found, comparison, [ProbableEffect("dead_zone", 0.6, False, {}, (), "By hand.")])
    assert ("By hand." in advice) is told
    assert ("record again as before: that is expected to tell more" in advice[0]) is (repetition > separation)
