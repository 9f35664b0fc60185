"""Another effect in the place of one: by sets with scores set by hand, and on a recording of the planar model."""

import pytest
from synthetic_recordings import synthetic_recording
from test_likeliest import BASE, CHOSEN, SETTINGS, SIZE, hypothesis

from twbal.diagnosis import exchange
from twbal.diagnosis.candidates import Candidate, always_free
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.hypothesis import Round
from twbal.diagnosis.name import QUIETEST, first_noise, largest_noise, with_fitted_noise
from twbal.diagnosis.problem import Problem, Selection
from twbal.diagnosis.score_test import ScoredCandidate
from twbal.planar.parameters import planar_parameters
from twbal.sysid.model import Data, Model

OTHER = Candidate("gyro_bias", (SIZE,), (), (), "")
LEFT = 100.0  # score of the chosen set without either of its effects


@pytest.fixture
def exchange_effects(monkeypatch):
    """How a selection ends where another effect is predicted to gain so much, and then scores so much in one place."""

    def end(predicted, score, chosen=CHOSEN, rounds=()):
        tried = []

        def fit(data, model, always, candidates, rounds):
            names = [candidate.name for candidate in candidates]
            tried.append(tuple(sorted(names)))
            return hypothesis(score if len(names) == 2 else LEFT, *names)

        def scores(data, fit, candidates):
            return [ScoredCandidate(each, predicted, None, {}) for each in candidates]

        monkeypatch.setattr("twbal.diagnosis.problem.fit_hypothesis", fit)
        monkeypatch.setattr(exchange, "score_candidates", scores)
        monkeypatch.setattr(exchange, "bic_penalty", lambda candidates, count: 0.0)
        monkeypatch.setattr(Problem, "add_to", lambda self, w, known: Round(w, [None], []))
        problem = Problem(_Data(), None, (), (OTHER,), SETTINGS)
        found = exchange.exchanged(problem, Selection(BASE, rounds, chosen), lambda line: None)
        return found, tried

    return end


class _Data:
    count = 1000


LOST = CHOSEN.fit.cost * -1.0 - 2.0 * LEFT  # in BIC, by the chosen set without one of its effects


def test_an_effect_that_explains_more_takes_the_place_of_one(exchange_effects):
    found, _ = exchange_effects(LOST + 100.0, 560.0)
    assert OTHER.name in found.chosen.names
    assert len(found.chosen.names) == 2
    assert {w.names for w in found.sets} >= {CHOSEN.names, found.chosen.names}


@pytest.mark.parametrize("score", [500.5, 400.0], ids=["as much", "less"])
def test_one_that_explains_no_more_does_not(exchange_effects, score):
    """A gain of one in BIC lies between effects that do the same."""
    found, _ = exchange_effects(LOST + 100.0, score)
    assert found.chosen is CHOSEN
    assert any(OTHER.name in w.names for w in found.sets)


def test_one_that_is_predicted_to_gain_too_little_is_not_fitted(exchange_effects):
    found, tried = exchange_effects(0.2 * LOST, 560.0)
    assert found.chosen is CHOSEN
    assert not any(OTHER.name in names for names in tried)


def test_what_was_weighed_beside_the_rest_already_is_not_tried_again(exchange_effects):
    """Both effects were added to the one that is left: what could take their places was seen then."""
    rests = [hypothesis(LEFT, each) for each in CHOSEN.names]
    found, tried = exchange_effects(LOST + 100.0, 560.0, rounds=tuple(Round(rest, [None], []) for rest in rests))
    assert found.chosen is CHOSEN
    assert tried == []


def test_exchanges_that_another_search_tried_are_not_tried_again(exchange_effects):
    found, tried = exchange_effects(LOST + 100.0, 400.0)
    assert tried
    again, tried = exchange_effects(LOST + 100.0, 400.0, rounds=found.rounds)
    assert (again.chosen, again.rounds, tried) == (CHOSEN, found.rounds, [])


def test_a_single_effect_stays(exchange_effects):
    """All others were weighed when it was chosen."""
    one = hypothesis(500.0, "actuation_delay")
    found, tried = exchange_effects(1000.0, 900.0, chosen=one)
    assert found.chosen is one
    assert tried == []


def test_an_effect_at_a_bound_takes_no_place(exchange_effects, monkeypatch):
    monkeypatch.setattr(Problem, "is_sound", lambda problem, hypothesis, base: False)
    found, _ = exchange_effects(LOST + 100.0, 560.0)
    assert found.chosen is CHOSEN


def test_a_friction_of_the_floor_gives_way_to_that_of_the_joints(paper):
    """A search came to the wrong one, beside a delay that is right."""
    hidden = {"viscous_friction": {"coefficient": 0.06}, "actuation_delay": {"delay": 0.012}}
    recordings = [synthetic_recording(paper, hidden, seed=s, periods=300) for s in (71, 72)]
    data, planar = Data(recordings, SETTINGS.substeps, largest_noise(paper), QUIETEST), planar_parameters(paper, {})
    start = with_fitted_noise(data, Model(planar, 0.0, first_noise(paper, data.sensed)))
    by_name = {c.name: c for c in candidates_for(paper)}
    few = [by_name[each] for each in (*hidden, "rolling_viscous", "ground_slope", "motor_lag", "gyro_bias")]
    problem = Problem(data, start, always_free(SETTINGS.tolerances, planar, 2), few, SETTINGS)
    base = problem.fit(start, (), 3)
    wrong = problem.fit_at_once([by_name["actuation_delay"], by_name["rolling_viscous"]])
    found = exchange.exchanged(problem, Selection(base, (), wrong), lambda line: None).chosen
    assert found.names == tuple(sorted(hidden))
    assert found.bic < wrong.bic
    for effect, values in hidden.items():
        for key, value in values.items():
            assert found.fit.model.value(f"{effect}_{key}") == pytest.approx(value, rel=0.15)
