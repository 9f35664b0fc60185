"""A set that is clearly likelier takes the place of the chosen one, told by sets with scores set by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis_settings import SETTINGS

from twbal.diagnosis import likeliest, probable
from twbal.diagnosis.candidates import Candidate, CandidateParameter
from twbal.diagnosis.hypothesis import FittedHypothesis, Round
from twbal.diagnosis.problem import Problem, Selection
from twbal.diagnosis.verdict import probabilities, temperature_of
from twbal.sysid.model import FreeParameter
from twbal.sysid.prediction_error_fit import Fit

COLOUR = 2.0
SIZE = CandidateParameter("size", "", 0.0, 1.0, 0.5, 0.0)


def hypothesis(score, *names, value=0.5):
    """A set with this score over the autocorrelation that it leaves, its effects of this size."""
    candidates = tuple(Candidate(name, (SIZE,), (), (), "") for name in names)
    free_parameters = tuple(
        FreeParameter(c.field(SIZE), 0.0, 1.0, 0.0, np.inf, 1e-4, c.name, "size") for c in candidates
    )
    model = SimpleNamespace(put=lambda values: values, value=lambda field: value)
    return FittedHypothesis(
        candidates, Fit(model, free_parameters, -score * COLOUR, None, np.zeros(8)), np.full(4, COLOUR), 0.0
    )


BASE = hypothesis(0.0)
CHOSEN = hypothesis(500.0, "actuation_delay", "coulomb_friction")


def selected(*others):
    """A selection that ended with the chosen set, although it had fitted others."""
    return Selection(BASE, (Round(BASE, [], list(others)),), CHOSEN)


@pytest.fixture
def ended_selection(monkeypatch):
    """How a selection ends, where taking an effect off a set costs all that it gains."""
    monkeypatch.setattr(Problem, "add_to", lambda self, w, known: Round(w, [], []))
    monkeypatch.setattr(
        "twbal.diagnosis.problem.fit_hypothesis",
        lambda data, model, always, rest, rounds: hypothesis(100.0, *(c.name for c in rest)),
    )
    problem = Problem(None, None, (), (), SETTINGS)

    def end(*others):
        selection = selected(*others)
        return likeliest.with_likeliest(problem, selection, probabilities(selection, SETTINGS), lambda line: None)

    return end


@pytest.fixture
def ended(ended_selection):
    """Names of the set with which it ends."""
    return lambda *others: ended_selection(*others).chosen.names


def test_a_likelier_set_of_other_effects_takes_the_place(ended):
    assert ended(hypothesis(520.0, "dead_zone", "motor_lag")) == ("dead_zone", "motor_lag")


@pytest.mark.parametrize(
    "other",
    [
        hypothesis(502.0, "dead_zone", "motor_lag"),
        hypothesis(520.0, "actuation_delay", "coulomb_friction", "motor_lag"),
        hypothesis(520.0, "dead_zone", "motor_lag", value=0.9999),
        hypothesis(520.0, "dead_zone", "motor_lag", value=0.001),
    ],
    ids=["hardly likelier", "with what was chosen and more", "at a bound", "negligible"],
)
def test_no_other_set_takes_the_place(other, ended):
    assert ended(other) == CHOSEN.names


def test_the_set_whose_place_was_taken_keeps_its_weight(ended_selection):
    selection = ended_selection(hypothesis(506.0, "dead_zone", "motor_lag"))
    assert selection.chosen.names == ("dead_zone", "motor_lag")
    assert probabilities(selection, SETTINGS)[CHOSEN.names] == pytest.approx(1.0 / (1.0 + np.exp(6.0 / 8.0)), rel=1e-3)


def test_what_a_filter_of_the_tilt_gains_alone_makes_no_set_less_sure():
    """What the others gain does; and so does all of it where the filter alone was not fitted."""
    filtered, chosen = hypothesis(9000.0, "tilt_filter"), hypothesis(12000.0, "motor_lag", "tilt_filter")
    selection = Selection(BASE, (Round(BASE, [], [filtered]),), chosen)
    assert temperature_of(selection, SETTINGS) == pytest.approx(SETTINGS.misfit_share * COLOUR * 3000.0)
    without = Selection(BASE, (Round(BASE, [], []),), chosen)
    assert temperature_of(without, SETTINGS) == pytest.approx(SETTINGS.misfit_share * COLOUR * 12000.0)


@pytest.mark.parametrize(
    ("rest", "left"),
    [({"score": 519.0}, ("dead_zone",)), ({"score": 519.0, "value": 0.9999}, ("dead_zone", "motor_lag"))],
    ids=["worth nothing", "worth nothing, but what is left runs to a bound"],
)
def test_what_is_of_no_use_in_the_likeliest_set_is_taken_off_unless_the_rest_is_unsound(
    rest, left, ended_selection, monkeypatch
):
    lighter = {("dead_zone",): rest, ("motor_lag",): {"score": 100.0}, (): {"score": 0.0}}

    def fit(data, model, always, candidates, rounds):
        names = tuple(c.name for c in candidates)
        return hypothesis(lighter[names]["score"], *names, value=lighter[names].get("value", 0.5))

    monkeypatch.setattr("twbal.diagnosis.problem.fit_hypothesis", fit)
    assert ended_selection(hypothesis(520.0, "dead_zone", "motor_lag")).chosen.names == left


def outweighed(*others):
    selection = selected(*others)
    return probable.outweighed(selection, probabilities(selection, SETTINGS), SETTINGS)


def test_what_most_of_the_weight_does_without_is_objected_to():
    (objection,) = outweighed(hypothesis(540.0, "coulomb_friction", "dead_zone", "motor_lag", value=0.9999))
    assert objection.effects == ("actuation_delay",)
    text = "Sets of effects without the actuation delay are together likelier (95%)"
    assert objection.text == f"{text}; the likeliest of them is coulomb friction, dead zone, motor lag (95%)."


def test_the_likeliest_set_without_an_effect_is_told_and_not_one_that_holds_it():
    others = [hypothesis(499.5, "backlash", name) for name in ("cogging", "dead_zone", "motor_lag")]
    objections = outweighed(*others)
    assert [objection.effects[0] for objection in objections] == ["actuation_delay", "coulomb_friction"]
    assert all("likeliest of them is backlash, " in objection.text for objection in objections)


def test_an_effect_that_another_replaces_beside_the_rest_is_not_objected_to():
    assert not outweighed(hypothesis(505.0, "coulomb_friction", "motor_lag"))


def test_what_is_too_small_to_be_named_is_not_objected_to():
    small = hypothesis(500.0, "actuation_delay", "coulomb_friction", value=0.01)
    others = [hypothesis(520.0, "backlash", "cogging", value=0.9999)]
    selection = Selection(BASE, (Round(BASE, [], others),), small)
    assert not probable.outweighed(selection, probabilities(selection, SETTINGS), SETTINGS)


RIVAL = hypothesis(499.0, "dead_zone", "motor_lag")


@pytest.mark.parametrize(
    ("others", "objected", "expected"),
    [
        ([RIVAL], {CHOSEN.names}, RIVAL.names),  # about as likely, with nothing against it
        ([RIVAL], set(), CHOSEN.names),
        ([RIVAL], {CHOSEN.names, RIVAL.names}, CHOSEN.names),
        ([hypothesis(480.0, "dead_zone", "motor_lag")], {CHOSEN.names}, CHOSEN.names),  # far less likely
    ],
)
def test_of_sets_that_are_about_as_likely_one_without_an_objection_is_chosen(others, objected, expected):
    selection = selected(*others)
    weights = probabilities(selection, SETTINGS)
    assert likeliest.unobjected(selection, weights, lambda w: w.names in objected).names == expected
