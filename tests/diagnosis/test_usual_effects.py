"""A search that begins with what hardly a robot is without finds effects that hide each other."""

from types import SimpleNamespace

import pytest
from diagnosis_settings import SETTINGS
from synthetic_recordings import synthetic_recording

from twbal.diagnosis.advice import OUTWEIGHED, UNEXPLAINED, advise
from twbal.diagnosis.candidates import always_free
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.name import QUIETEST, first_noise, largest_noise, with_fitted_noise
from twbal.diagnosis.objections import Objection
from twbal.diagnosis.problem import Problem, Selection
from twbal.diagnosis.record import Verdict
from twbal.diagnosis.usual_effects import USUAL, search_from_usual
from twbal.planar.parameters import planar_parameters
from twbal.sysid.model import Data, Model

HIDDEN = {
    "torque_gain": {"gain": 0.6},
    "com_offset": {"angle": 0.05},
    "actuation_delay": {"delay": 0.015},
    "coulomb_friction": {"torque": 0.5},
}
SHORT = Objection("The recordings are short.", is_of_length=True)


@pytest.fixture(scope="module")
def problem(paper):
    data = Data([synthetic_recording(paper, HIDDEN, seed=s, periods=200) for s in (61, 62)], 10)
    planar = planar_parameters(paper, {})
    start = with_fitted_noise(
        Data(data.recordings, 10, largest_noise(paper), QUIETEST), Model(planar, 0.0, first_noise(paper, data.sensed))
    )
    few = [c for c in candidates_for(paper) if c.name in {*USUAL, "ground_slope", "battery_sag", "motor_lag"}]
    return Problem(data, start, always_free(SETTINGS.tolerances, planar, 2), few, SETTINGS)


@pytest.fixture(scope="module")
def base(problem):
    return problem.fit(problem.start, (), 3)


def test_all_that_is_hidden_is_found_from_the_refitted_data_sheet_and_nothing_else(problem, base):
    said = []
    found = search_from_usual(problem, Selection(base, (), base), said.append)
    assert found.chosen.names == tuple(sorted(HIDDEN))
    for name, values in HIDDEN.items():
        for key, value in values.items():
            assert found.chosen.fit.model.value(f"{name}_{key}") == pytest.approx(value, rel=0.15)
    assert found.chosen.bic < base.bic
    assert {found.chosen.names} <= {w.names for w in found.sets}
    assert all(line.startswith("third search: ") for line in said)


def test_a_selection_that_does_better_stays(problem, base):
    better = Selection(base, (), base._replace(bic_penalty=-1e6))
    few = problem._replace(candidates=[c for c in problem.candidates if c.name in ("torque_gain", "com_offset")])
    assert search_from_usual(few, better, lambda line: None) is better


@pytest.mark.parametrize(("worse", "steps"), [(1.0, 2), (-1.0, 1)])
def test_the_search_ends_where_all_of_them_explain_less_than_the_set_that_is_there(
    problem, base, worse, steps, monkeypatch
):
    said, at_once = [], problem.fit_at_once([c for c in problem.candidates if c.name in USUAL])
    monkeypatch.setattr(Problem, "fit_at_once", lambda self, candidates: at_once)
    monkeypatch.setattr("twbal.diagnosis.usual_effects.without_redundant", lambda *arguments, **named: base)
    chosen = base._replace(bic_penalty=at_once.fit.cost + worse - base.fit.cost)
    search_from_usual(problem, Selection(base, (), chosen), said.append)
    assert len(said) == steps


def test_where_no_usual_effect_may_be_missing_nothing_is_searched(problem):
    untouched = Selection(None, (), None)
    others = problem._replace(candidates=[c for c in problem.candidates if c.name not in USUAL])
    assert search_from_usual(others, untouched, lambda line: None) is untouched


@pytest.mark.parametrize(
    ("objected", "opening"),
    [
        ((SHORT,), SHORT.text),
        ((SHORT, Objection("Others are likelier.", is_of_weights=True)), OUTWEIGHED),
        ((SHORT, Objection("The residuals stay autocorrelated.")), UNEXPLAINED),
    ],
)
def test_that_recordings_are_short_does_not_say_that_nothing_explains_them(objected, opening):
    selection = SimpleNamespace(chosen=None, rounds=[SimpleNamespace(scored=[])])
    assert advise(selection, objected, 0.0, (), None, Verdict.UNKNOWN, SETTINGS)[0] == opening
