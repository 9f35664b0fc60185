"""The score test of candidates, by models whose answer is known and on recordings that were made for it."""

from dataclasses import replace
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from synthetic_recordings import NOISE, synthetic_recording

from twbal.diagnosis import score_test
from twbal.diagnosis.candidates import Candidate, CandidateParameter, always_free
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.score_test import ScoredCandidate, score_candidates
from twbal.diagnosis.settings import Tolerances
from twbal.planar.parameters import planar_parameters
from twbal.sysid.model import Data, FreeParameter, Model
from twbal.sysid.noise import NoiseModel
from twbal.sysid.prediction_error_fit import Fit

TOLERANCES = Tolerances(0.03, 0.15, 0.0003, 0.00025, 0.0, 0.0, 0.0, 0.15)


@pytest.mark.parametrize(("name", "size"), [("periodic_disturbance", 3.0), ("torque_saturation", 1.2)])
def test_what_a_usual_size_would_have_gained_is_what_it_gains_where_it_is(paper, name, size):
    """Waves and limits, too: on a clean recording their usual size is none of the sizes that are tried."""
    (candidate,) = (each for each in candidates_for(paper) if each.name == name)
    first, *others = candidate.parameters
    candidate = candidate._replace(parameters=(first._replace(start=size), *others))
    values = {p.name: p.start for p in candidate.parameters}
    clean, other = (
        Data([synthetic_recording(paper, effects, seed=3, periods=900, tolerance=0.0)], 10)
        for effects in ({}, {name: values})
    )
    model = Model(planar_parameters(paper, {}), 0.0, NoiseModel(np.array([*NOISE.values()]), np.array([0.02, 0.02])))
    fits = [Fit(model, (), 0.0, data.filter(model), data.white(model, data.filter(model))) for data in (clean, other)]
    (said,) = score_candidates(clean, fits[0], [candidate])
    present = other.white(model.put({f"{name}_{key}": value for key, value in values.items()}), fits[1].kalman)
    gained = float(fits[1].white @ fits[1].white - present @ present)
    assert gained > 1000.0
    assert 0.25 < said.detectable[1.0] / gained < 4.0  # to first order, and the other robot takes another course


def test_a_limit_between_one_that_changes_nothing_and_one_that_is_too_low_is_found(paper):
    """Commands reach 6.2 N·m: of the limits that are tried on every robot, 7 changes nothing and 5 does harm."""
    (candidate,) = (each for each in candidates_for(paper) if each.name == "torque_saturation")
    limited = synthetic_recording(paper, {"torque_saturation": {"limit": 5.4}}, seed=3, periods=900, tolerance=0.0)
    data = Data([limited], 10)
    model = Model(planar_parameters(paper, {}), 0.0, NoiseModel(np.array([*NOISE.values()]), np.array([0.02, 0.02])))
    kalman = data.filter(model)
    (found,) = score_candidates(data, Fit(model, (), 0.0, kalman, data.white(model, kalman)), [candidate])
    assert found.gain > 50.0
    assert found.model.value("torque_saturation_limit") == pytest.approx(5.4, rel=0.01)


def test_beside_a_set_whose_predictions_diverge_nothing_is_scored(paper):
    """Such a set is one without an effect that goes, where nothing else holds the predictor."""
    data = Data([synthetic_recording(paper, {}, seed=3, periods=900, tolerance=0.0)], 10)
    model = Model(planar_parameters(paper, {}), 0.0, NoiseModel(np.array([*NOISE.values()]), np.array([0.02, 0.02])))
    kalman = data.filter(model)
    away = kalman._replace(gains=-10.0 * kalman.gains)
    white = data.white(model, away)
    assert not np.isfinite(white).all()
    fit = Fit(model, tuple(always_free(TOLERANCES, model.planar, 1)), np.inf, away, white)
    assert score_candidates(data, fit, candidates_for(paper)) == []


@pytest.mark.parametrize("frequency", [2.5, 11.0])
def test_the_frequency_at_which_a_frame_rings_is_found_far_from_the_usual_one(paper, frequency):
    (candidate,) = (each for each in candidates_for(paper) if each.name == "flexible_frame")
    values = {"share": 0.1, "frequency": frequency, "damping": 0.05, "height": 1.8}
    data = Data([synthetic_recording(paper, {"flexible_frame": values}, seed=3, periods=900, tolerance=0.0)], 10)
    model = Model(planar_parameters(paper, {}), 0.0, NoiseModel(np.array([*NOISE.values()]), np.array([0.02, 0.02])))
    kalman = data.filter(model)
    (found,) = score_candidates(data, Fit(model, (), 0.0, kalman, data.white(model, kalman)), [candidate])
    assert found.gain > 100.0
    assert found.model.planar.flexible_frame_frequency == pytest.approx(frequency, rel=0.15)


@pytest.mark.parametrize(("gap", "share", "time"), [(0.05, 0.7, 0.006), (0.01, 0.25, 0.004)])
def test_play_is_found_far_from_the_usual_one(paper, gap, share, time):
    """How likely it makes the recording has many peaks: a fit from the usual start alone ends at another one."""
    quick = replace(paper, control_period=0.005)
    (candidate,) = (each for each in candidates_for(quick) if each.name == "backlash")
    values = {"gap": gap, "rotor_share": share, "contact_time": time, "contact_damping": 0.3}
    data = Data([synthetic_recording(quick, {"backlash": values}, seed=3, periods=2000, tolerance=0.0)], 3)
    model = Model(planar_parameters(quick, {}), 0.0, NoiseModel(np.array([*NOISE.values()]), np.array([0.02, 0.02])))
    kalman = data.filter(model)
    fit = Fit(model, (), 0.0, kalman, data.white(model, kalman))
    (found,) = score_candidates(data, fit, [candidate])
    (usual,) = score_candidates(data, fit, [candidate._replace(tried_at=())])
    assert found.gain > 1.2 * usual.gain
    best = found.model.planar  # the wheels feel the momentum of rotors that cross the gap: width and share trade off
    assert best.backlash_gap * best.backlash_rotor_share == pytest.approx(gap * share, rel=0.25)
    true = data.white(model.put({f"backlash_{name}": value for name, value in values.items()}), kalman)
    assert found.gain > 0.9 * float(fit.white @ fit.white - true @ true)


class LinearModel(NamedTuple):
    """A model whose whitened errors are linear in its values, by field."""

    values: dict[str, float]
    apart = None

    def put(self, values):
        return LinearModel({**self.values, **values})

    def value(self, field):
        return self.values[field]


def test_a_limit_that_another_value_stands_for_gains_what_least_squares_of_both_gain():
    """Either alone makes the errors larger: the limit moves them by far more than it explains of them.

    Truth: the least squares of the value at the limit that was found, and of the limit on a fine grid.
    """
    rng = np.random.default_rng(1)
    by_value, explained = rng.standard_normal((2, 400))
    by_limit = 8.0 * by_value + explained
    noise = rng.standard_normal(400)
    noise -= by_value * (by_value @ noise) / (by_value @ by_value)
    errors = noise + 0.5 * (explained - by_value * (by_value @ explained) / (by_value @ by_value))

    def white(model, kalman=None):
        return errors - by_limit * (1.0 - model.value("cap_limit")) - by_value * model.value("gain")

    data = SimpleNamespace(white=white, recordings=[np.zeros(100)])
    free = FreeParameter("gain", -10.0, 10.0, 0.0, np.inf, 1e-5)
    start = LinearModel({"gain": 0.0, "cap_limit": 1.0})
    candidate = Candidate("cap", (CandidateParameter("limit", "", 0.0, 1.0, 0.5, 1.0),), (), (), "")
    (found,) = score_candidates(data, Fit(start, (free,), 0.0, None, white(start)), [candidate])
    most = max(
        float(errors @ errors) - least_squares_left(errors - by_limit * away, by_value)
        for away in np.linspace(0.0, 1.0, 1001)
    )
    assert found.gain == pytest.approx(most, rel=0.02)
    assert most > 50.0
    assert all(float(np.sum(white(start.put({"cap_limit": limit})) ** 2)) > errors @ errors for limit in (0.9, 0.5))


def test_large_joint_gains_of_many_leave_one_with_a_sure_gain_in_its_place(monkeypatch):
    """They are predicted too large as a rule, and once a slope of the ground was not fitted for that."""
    many = [Candidate(f"other_{i}", (), (), (), "") for i in range(30)]
    sure, fitted = Candidate("ground_slope", (), (), (), ""), []

    def predicted(data, fit, J, candidate):
        is_sure = candidate is sure
        return ScoredCandidate(candidate, 280.0 if is_sure else 1.0, None, {}, 300.0 if is_sure else 9000.0)

    def fit_briefly(data, fit, J, scored):
        fitted.append(scored.candidate.name)
        return scored._replace(gain=280.0 if scored.candidate is sure else 3.0)

    monkeypatch.setattr(score_test, "slopes_of", lambda data, fit: None)
    monkeypatch.setattr(score_test, "_predict", predicted)
    monkeypatch.setattr(score_test, "_fit_briefly", fit_briefly)
    fit = SimpleNamespace(white=np.zeros(3))
    found = score_candidates(None, fit, [*many, sure])
    assert found[0].candidate is sure
    assert sure.name in fitted
    assert len(found) == 31
    assert len(fitted) < 10


def least_squares_left(errors, column):
    """Sum of squares that one column leaves."""
    return float(errors @ errors - (errors @ column) ** 2 / (column @ column))


def test_no_frequency_is_tried_that_samples_hardly_show(paper):
    slow = replace(paper, control_period=0.05)
    highest = {
        each.name: parameter.high
        for each in candidates_for(slow)
        for parameter in each.parameters
        if parameter.unit == "Hz"
    }
    assert highest == {"flexible_frame": pytest.approx(8.0), "periodic_disturbance": pytest.approx(8.0)}
