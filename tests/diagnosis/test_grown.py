"""What a set asks for after a search changed it, told by sets with scores set by hand."""

import pytest
from test_likeliest import BASE, CHOSEN, SETTINGS, hypothesis

from twbal.diagnosis import grown
from twbal.diagnosis.hypothesis import Round
from twbal.diagnosis.problem import Problem, Selection

LARGER = hypothesis(560.0, *CHOSEN.names, "gyro_bias")


@pytest.fixture
def grow(monkeypatch):
    """How a selection ends whose set gains by one more effect; taking an effect off costs what `left` leaves."""

    def end(rounds, larger=LARGER, left=300.0):
        def add(problem, w, known):
            return Round(w, [None], [larger] if w.names == CHOSEN.names else [])

        def fit(data, model, always, rest, rounds):
            return hypothesis(left, *(candidate.name for candidate in rest))

        monkeypatch.setattr(Problem, "add_to", add)
        monkeypatch.setattr("twbal.diagnosis.problem.fit_hypothesis", fit)
        problem = Problem(None, None, (), (), SETTINGS)
        return grown.grown(problem, Selection(BASE, rounds, CHOSEN), lambda line: None)

    return end


def test_a_set_for_which_no_other_effect_was_weighed_gets_what_it_asks_for(grow):
    asked = Round(BASE, [None], [CHOSEN])
    found = grow((asked,))
    assert found.chosen.names == LARGER.names
    assert found.rounds[0] is asked and {w.names for w in found.sets} >= {LARGER.names, CHOSEN.names}


def test_one_that_was_asked_already_stays(grow):
    assert grow((Round(CHOSEN, [None], []),)).chosen is CHOSEN


@pytest.mark.parametrize(
    "larger", [hypothesis(505.0, *LARGER.names), hypothesis(560.0, *LARGER.names, value=0.9999)], ids=["few", "bound"]
)
def test_nothing_is_added_that_gains_too_little_or_has_a_parameter_at_a_bound(grow, larger):
    assert grow((), larger).chosen.names == CHOSEN.names


def test_what_the_new_effect_makes_needless_goes(grow):
    """Each set with fewer effects explains as much, but for the one without any."""
    assert grow((), left=559.0).chosen.names == ("gyro_bias",)
