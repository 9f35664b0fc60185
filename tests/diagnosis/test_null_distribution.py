"""The best score where nothing is missing: as drawn, against recordings and series in which nothing is missing."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_settings import SETTINGS
from synthetic_recordings import NOISE, synthetic_recording

from twbal.diagnosis import null_distribution as null
from twbal.diagnosis.candidates import always_free
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.hypothesis import bic_penalty, fit_hypothesis
from twbal.diagnosis.score_test import ScoredCandidate, score_candidates
from twbal.planar.parameters import planar_parameters
from twbal.sysid.model import Data, Model
from twbal.sysid.noise import NoiseModel

PERIODS, ROBOTS = 400, 24
TORQUE_NOISE = 0.05  # N·m; without any, the filter never settles, and what it leaves is less than white
SPREAD = 0.03 * 3.0**0.5  # of a uniform distribution with a standard deviation of 3 %, as the tolerance is
TOLERANCES = SETTINGS.tolerances
SMALL = {
    "actuation_delay": 1e-5,
    "viscous_friction": 1e-4,
    "ground_slope": 1e-5,
    "gyro_bias": 1e-5,
    "gyro_scale": 1e-4,
    "cable_spring": 1e-3,
}
"""Sizes of effects that change the errors hardly."""

TWO_SIDED = ("ground_slope", "gyro_bias", "gyro_scale")


@pytest.fixture(scope="module")
def some(paper):
    """Without a cable, whose place is free as well: one regression by its stiffness is not its score."""
    return [each for each in candidates_for(paper) if each.name in SMALL and each.name != "cable_spring"]


def refitted(robot, effects, seed):
    """Recordings of a robot, and its data sheet refitted to them."""
    recording = synthetic_recording(robot, effects, seed, PERIODS, tolerance=SPREAD, torque_noise=TORQUE_NOISE)
    data, planar = Data([recording], 10), planar_parameters(robot, {})
    noise = NoiseModel(np.array([*NOISE.values()]), np.array([TORQUE_NOISE, 1e-6]))
    return data, fit_hypothesis(data, Model(planar, 0.0, noise), always_free(TOLERANCES, planar, 1), (), 0)


def best_by_least_squares(data, base, some):
    """The best score of small effects, each by a linear regression on what is free and on the effect."""

    def white(model):
        K = base.fit.kalman
        return np.concatenate([K.whiteners[min(n, 49)] @ e for n, e in enumerate(data.errors(model, K)[0])][1:])

    model, frees = base.fit.model, base.fit.free_parameters
    begin, sds = white(model), np.array([free.sd for free in frees])
    slopes = np.stack([(white(model.put({f.field: model.value(f.field) + f.nudge})) - begin) / f.nudge for f in frees])
    of_priors = [(model.value(f.field) - f.mean) / f.sd for f in frees]
    y, A = np.append(begin, of_priors), np.vstack([slopes.T, np.diag(1.0 / sds)])
    scores = []
    for each in some:
        first = each.parameters[0]
        moved = model.put({each.field(first): first.none + SMALL[each.name]})
        change = np.append(white(moved) - begin, np.zeros(len(frees)))
        with_it = np.column_stack([A, change / np.abs(change).max()])
        weights, *_ = np.linalg.lstsq(with_it, -y, rcond=None)
        without, *_ = np.linalg.lstsq(A, -y, rcond=None)
        gain = np.sum((y + A @ without) ** 2) - np.sum((y + with_it @ weights) ** 2)
        gain = gain if each.name in TWO_SIDED or weights[-1] > 0.0 else 0.0
        scores.append(gain - bic_penalty([each], data.count))
    return max(scores)


def test_best_scores_of_recordings_without_effects_are_as_they_were_drawn(paper, some):
    """By recordings of another integrator, and one regression for each effect."""
    best, own, ranks, p_values = [], [], [], []
    for seed in range(ROBOTS):
        data, base = refitted(paper, {}, 300 + seed)
        drawn = null.null_distribution(data, base, some, {}, 1.0)
        best.append(best_by_least_squares(data, base, some))
        ranks.append(float(np.mean(drawn.effects < best[-1])))
        found = null.null_score(data, drawn, [ScoredCandidate(each, 0.0, base.fit.model, {}) for each in some], base)
        own.append(found.score)
        p_values.append(found.p_value)
    assert np.corrcoef(own, best)[0, 1] > 0.9
    for shares in (ranks, p_values):
        assert np.mean(shares) == pytest.approx(0.5, abs=3.0 * (1.0 / 12.0 / ROBOTS) ** 0.5)
        assert np.mean(np.array(shares) > 0.9) < 0.1 + 3.0 * (0.09 / ROBOTS) ** 0.5
    assert max(ranks) < 1.0 - 1e-4 and min(p_values) > 1e-3


def test_the_best_of_many_frequencies_is_as_good_as_in_white_series():
    """By the periodogram of white noise at eight times as many frequencies as its periods can tell apart."""
    count, period, low, high = 400, 0.02, 1.0, 6.0
    series = np.random.default_rng(3).normal(size=(2000, count))
    power = 2.0 * np.abs(np.fft.rfft(series, 8 * count)) ** 2 / count
    frequencies = np.fft.rfftfreq(8 * count, period)
    best = power[:, (frequencies >= low) & (frequencies <= high)].max(axis=1)
    planes = 1.0 + null._PLANES * (high - low) * count * period
    drawn = null._largest_of_planes(planes, np.random.default_rng(4).random(20_000))
    for share in (0.9, 0.99, 0.999):
        assert np.quantile(drawn, share) == pytest.approx(np.quantile(best, share), rel=0.06)


def test_an_effect_that_is_there_scores_more_than_chance_makes_one_score(paper, some):
    data, base = refitted(paper, {"viscous_friction": {"coefficient": 0.2}}, 7)
    drawn = null.null_distribution(data, base, some, {}, 1.0)
    found = null.null_score(data, drawn, score_candidates(data, base.fit, some), base)
    assert found.name == "viscous_friction" and found.p_value == pytest.approx(1e-4, rel=0.01)
    assert found.score > drawn.exceeded_with(1e-3).effect > found.high > found.median
    assert "viscous friction, has a score of" in found.text and "less than 0.1%" in found.text


def test_the_same_recordings_have_the_same_least_scores(paper, some):
    data, base = refitted(paper, {}, 8)
    one, other = (null.null_distribution(data, base, some, {}, 1.0).exceeded_with(0.01) for _ in range(2))
    assert one == other and one.effect > 0.0


def test_scores_count_the_instants_that_count_over_the_residual_autocorrelation(paper, some):
    data, base = refitted(paper, {}, 7)
    (recording,) = data.recordings
    usable = recording.usable & (np.arange(len(recording) + 1) % 3 > 0)
    data = replace(data, recordings=[replace(recording, usable=usable)])
    louder = base._replace(autocorrelations=np.full(4, 5.0))
    (friction,) = (each for each in some if each.name == "viscous_friction")
    (scored,) = score_candidates(data, louder.fit, [friction])
    drawn = null.null_distribution(data, louder, [friction], {}, 1.0, 5.0)
    found = null.null_score(data, drawn, [scored], louder)
    assert 250 < data.count < 280
    assert found.score == pytest.approx(drawn.gains["viscous_friction"] - np.log(data.count) / 5.0)
    assert drawn.effects.min() == pytest.approx(-np.log(data.count) / 5.0)


def test_values_that_do_the_same_leave_directions(paper, some):
    """Two free values without a prior of which only the sum matters."""
    data, base = refitted(paper, {}, 8)
    twice = base.fit._replace(free_parameters=(*base.fit.free_parameters, *base.fit.free_parameters[:1]))
    drawn = null.null_distribution(data, base._replace(fit=twice), some, {}, 1.0)
    assert np.isfinite(drawn.effects).all()


def test_errors_of_form_make_least_scores_higher(paper, some):
    data, base = refitted(paper, {}, 8)
    few = [each for each in some if len(each.parameters) == 1]
    (penalty,) = {bic_penalty([each], data.count) for each in few}
    one, twice = (null.null_distribution(data, base, few, {}, t).effects for t in (1.0, 2.0))
    np.testing.assert_allclose(twice, 2.0 * one + penalty)


def test_no_candidate_is_worth_its_penalty_below_a_score_of_nought():
    least = null.NullDistribution(np.full(10, -3.0), np.full(10, -np.inf), {}).exceeded_with(0.01)
    assert least == (0.0, 0.0)


def test_where_no_further_effect_is_weighed_there_is_no_score(paper):
    data, base = refitted(paper, {}, 8)
    drawn = null.null_distribution(data, base, [], {}, 1.0)
    assert null.null_score(data, drawn, [], base) is None and drawn.exceeded_with(0.01) == (0.0, 0.0)
