"""Which recording disagrees with the others: the estimate, its error, its false alarms, and what is told."""

from dataclasses import replace

import numpy as np
import pytest
from hydra import compose
from hydra.utils import instantiate
from synthetic_recordings import synthetic_recording

from twbal.cli.composition import composing
from twbal.diagnosis.advice import on_disagreements
from twbal.diagnosis.candidates import always_free
from twbal.diagnosis.disagreement import Pooled, SharedValue, ValueDifference, disagreements
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.follow_up import Disagreement
from twbal.diagnosis.hypothesis import fit_hypothesis
from twbal.diagnosis.model_comparison import ModelComparison
from twbal.diagnosis.problem import Problem
from twbal.diagnosis.verdict import Tempering, allowed_differences
from twbal.planar.parameters import planar_parameters
from twbal.sysid.model import Data, Model
from twbal.sysid.noise import NoiseModel

NOISE = NoiseModel(np.array([0.0035, 0.02, 0.001, 0.05]), np.array([0.02, 0.02]))
FRICTION = {"coulomb_friction": {"torque": 0.3}}
SIZE, BLOCKS, LOGS = 40, 8, 4


def linear(rng, delta=0.0, odd=0):
    """Four recordings of a linear model with two shared values, the first of which is off by `delta` in one of them."""
    count = LOGS * BLOCKS * SIZE
    J = rng.normal(size=(count, 2))
    white = rng.normal(size=count)
    own = slice(odd * BLOCKS * SIZE, (odd + 1) * BLOCKS * SIZE)
    white[own] -= delta * J[own, 0]
    blocks = [[slice((k * BLOCKS + b) * SIZE, (k * BLOCKS + b + 1) * SIZE) for b in range(BLOCKS)] for k in range(LOGS)]
    return Pooled(None, J, white, np.zeros((2, 2)), np.zeros(2), blocks), SharedValue("a.b", "", J[:, 0], 1.0, 0.0)


def test_the_difference_is_that_of_fits_to_the_one_and_to_the_others():
    pooled, value = linear(np.random.default_rng(0), delta=0.3, odd=1)
    found = pooled.difference(1, value, range(LOGS))
    own = np.zeros(len(pooled.white), bool)
    own[BLOCKS * SIZE : 2 * BLOCKS * SIZE] = True
    A = np.column_stack([np.where(own, pooled.J[:, 0], 0.0), np.where(own, 0.0, pooled.J[:, 0]), pooled.J[:, 1]])
    alone, others, _ = np.linalg.lstsq(A, -pooled.white, rcond=None)[0]
    assert found.delta == pytest.approx(alone - others)
    assert found.delta == pytest.approx(0.3, abs=4.0 * found.error)


def test_its_error_is_how_it_scatters_and_its_p_value_is_uniform_without_a_difference():
    rng = np.random.default_rng(1)
    drawn = [pooled.difference(2, value, range(LOGS)) for pooled, value in (linear(rng) for _ in range(400))]
    assert np.mean([each.error for each in drawn]) == pytest.approx(np.std([each.delta for each in drawn]), rel=0.12)
    assert np.mean([each.p_value < 0.1 for each in drawn]) == pytest.approx(0.09, abs=0.035)  # the wider error counts


def test_what_a_recording_that_is_left_out_holds_does_not_count():
    pooled, value = linear(np.random.default_rng(2), delta=2.0, odd=3)
    spoiled = pooled.difference(0, value, range(LOGS))
    clean = pooled.difference(0, value, [0, 1, 2])
    assert abs(spoiled.delta) > 5.0 * spoiled.error
    assert abs(clean.delta) < 4.0 * clean.error


def test_a_value_that_the_recordings_do_not_tell_of_differs_in_none():
    pooled, value = linear(np.random.default_rng(3))
    J = pooled.J * [1.0, 0.0]
    untold = replace(pooled, J=J).difference(1, SharedValue("c.d", "", J[:, 1], 1.0, 0.0), range(LOGS))
    assert (untold.sigmas, untold.p_value) == (0.0, 1.0)
    assert pooled.difference(1, value, range(LOGS)).sigmas > 0.0


def test_a_sure_difference_that_is_smaller_than_the_form_allows_is_none():
    value = SharedValue("a.b", "", np.zeros(0), 1.0, 0.05)
    sure = ValueDifference(value, 0.05, 0.001, 100)
    assert sure.sigmas == pytest.approx(50.0)
    assert sure.p_value > 0.3
    assert ValueDifference(value._replace(sign=-1.0), 0.5, 0.001, 100).p_value > 0.99  # a sign that cannot be


@pytest.fixture(scope="module")
def settings():
    with composing():
        return instantiate(compose("diagnose", ["episodes=e"]).diagnosis)


def odd_ones(paper, settings, odd, seed):
    """Disagreements of four recordings, of which the third is of a robot with other effects; the last is not fitted."""
    recordings = []
    for k in range(4):
        effects = FRICTION | (odd if k == 2 else {})
        recording = synthetic_recording(paper, effects, seed=10 * seed + k, periods=300, tolerance=0.0)
        recordings.append(replace(recording, name=f"log {k}"))
    data = Data(recordings[:3], 5)
    (candidate,) = [c for c in candidates_for(paper) if c.name == "coulomb_friction"]
    always = always_free(settings.tolerances, planar_parameters(paper, {}), 3)
    start = Model(planar_parameters(paper, {}), 0.0, NOISE)
    chosen = fit_hypothesis(data, start, always, [candidate], 1)
    problem = Problem(data, start, always, candidates_for(paper), settings)
    allowed = allowed_differences(problem, chosen)
    tempering = Tempering(1.0, 0.0, 0.0)
    comparison = ModelComparison(data, chosen, (), problem.candidates, tempering, allowed, chosen.fit)
    return disagreements(comparison, recordings[3:])


def test_recordings_of_one_robot_agree(paper, settings):
    assert odd_ones(paper, settings, {}, seed=1) == ()


@pytest.mark.slow
def test_recordings_of_one_robot_nearly_always_agree(paper, settings):
    assert sum(bool(odd_ones(paper, settings, {}, seed)) for seed in range(100, 120)) <= 3


@pytest.mark.parametrize(
    ("odd", "parameter", "difference"),
    [
        ({"coulomb_friction": {"torque": 0.45}}, "coulomb_friction.torque", 0.15),
        ({"ground_slope": {"angle": 0.03}}, "ground_slope.angle", 0.03),
    ],
)
def test_the_recording_of_a_changed_robot_is_told_with_what_was_changed(paper, settings, odd, parameter, difference):
    (found,) = odd_ones(paper, settings, odd, seed=2)
    assert found.recording == "log 2"
    assert found.others == ("log 0", "log 1", "log 3")
    assert parameter == found.parameter
    assert found.difference == pytest.approx(difference, abs=0.3 * abs(difference))
    assert found.p_value < 0.01


def test_the_advice_says_which_recording_in_what_and_how_surely():
    found = Disagreement("b", ("a", "c"), "torque_gain.gain", 0.9, -0.2, 0.02, "", 1e-4, ("body_mass.factor",))
    (said,) = on_disagreements([found])
    assert "Recording b disagrees with a, c: in torque gain (gain), or body mass (factor)" in said
    assert "-0.2 ± 0.039" in said
    assert "p = 0.0001" in said
    assert "No robot has that value" not in said
    assert on_disagreements([]) == ()


@pytest.mark.parametrize(("parameter", "impossible"), [("com_height.factor", True), ("com_offset.angle", False)])
def test_a_difference_to_a_factor_below_0_is_said_to_be_impossible_and_an_angle_may_change_its_sign(
    parameter, impossible
):
    (said,) = on_disagreements([Disagreement("b", ("a",), parameter, 0.25, -0.43, 0.06, "", 1e-6, ())])
    assert ("No robot has that value" in said) is impossible
