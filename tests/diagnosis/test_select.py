"""Which of two effects stays, told by sets with scores set by hand."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis_settings import SETTINGS
from hydra import compose
from hydra.utils import instantiate
from synthetic_recordings import synthetic_recording

from twbal.cli.composition import composing
from twbal.diagnosis import name, removal, tempered
from twbal.diagnosis.candidates import Candidate, CandidateParameter
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.hypothesis import FittedHypothesis, Round
from twbal.diagnosis.name import name_effects
from twbal.diagnosis.objections import BOUNDLESS, Extent
from twbal.diagnosis.problem import Problem, Selection
from twbal.diagnosis.record import Verdict
from twbal.diagnosis.score_test import ScoredCandidate
from twbal.diagnosis.verdict import probabilities
from twbal.sysid.model import Data
from twbal.sysid.prediction_error_fit import Fit

KIN = {"dead_zone": ("coulomb_friction",)}
COLOUR = 2.0
MODEL = SimpleNamespace(put=lambda values: values, value=lambda field: 0.5)
AT_BOUND = SimpleNamespace(put=lambda values: values, value=lambda field: 1.0)
FIT = "twbal.diagnosis.problem.fit_hypothesis"
MARGIN = SETTINGS.thresholds.equivalence_margin


def candidate(name):
    size = CandidateParameter("size", "", 0.0, 1.0, 0.5, 0.0)
    return Candidate(name, (size,), (), KIN.get(name, ()), "")


def hypothesis(score, *names, model=MODEL, overriding=()):
    """A set with this score over the autocorrelation that it leaves."""
    fit = Fit(model, (), -score * COLOUR, None, np.zeros(8))
    return FittedHypothesis(tuple(candidate(name) for name in names), fit, np.full(4, COLOUR), 0.0, overriding)


CHOSEN = hypothesis(500.0, "backlash", "dead_zone")
BASE = hypothesis(0.0)


def problem(settings=SETTINGS):
    return Problem(None, None, (), (), settings)


def beside(**scores):
    """A round in which these effects were tried beside the backlash."""
    return Round(
        hypothesis(400.0, "backlash"), [], [hypothesis(score, "backlash", name) for name, score in scores.items()]
    )


def test_what_no_robot_has_beside_an_effect_is_tried_in_its_place_only(paper):
    all_of_them = candidates_for(paper)
    by_name = {each.name: each for each in all_of_them}
    asked = Problem(None, None, (), all_of_them, SETTINGS)
    chosen = replace_candidates(hypothesis(500.0), by_name["backlash"], by_name["dead_zone"])
    assert "backlash_behind_encoder" not in {each.name for each in asked.beside(chosen)}
    assert "backlash_behind_encoder" in {each.name for each in asked.beside(chosen, by_name["backlash"])}
    given = name._missing(all_of_them, {"backlash": {"gap": 0.02}}, SETTINGS)
    assert not {"backlash", "backlash_behind_encoder"} & {each.name for each in given}


def replace_candidates(found, *candidates):
    return found._replace(candidates=candidates)


def test_what_does_as_well_in_the_place_of_an_effect_is_found():
    near = beside(dead_zone=500.0, actuation_delay=495.0, cogging=480.0)
    assert removal.substitutes(CHOSEN.candidates[1], CHOSEN, [near], MARGIN) == ["actuation_delay"]
    assert removal.substitutes(CHOSEN.candidates[0], CHOSEN, [near], MARGIN) == []


def test_a_value_of_the_data_sheet_is_no_equivalent_of_an_effect():
    height = Candidate("com_height", (CandidateParameter("factor", "", 0.25, 2.5, 1.1, 1.0),), (), (), "")
    near = hypothesis(499.0, "backlash", "com_height")
    assert removal.substitutes(CHOSEN.candidates[1], CHOSEN, [Round(BASE, [], [near])], MARGIN) == ["com_height"]
    near = near._replace(candidates=(near.candidates[0], height))
    assert height.in_data_sheet
    assert removal.substitutes(CHOSEN.candidates[1], CHOSEN, [Round(BASE, [], [near])], MARGIN) == []


@pytest.mark.parametrize(("model", "is_kept"), [(MODEL, False), (AT_BOUND, True)])
def test_a_selection_ends_with_the_best_fit_of_its_set(model, is_kept):
    """But not with one that ran to a bound."""
    again = hypothesis(520.0, "backlash", "dead_zone", model=model)
    frees = tuple(free for each in again.candidates for free in each.free_parameters)
    again = again._replace(fit=again.fit._replace(free_parameters=frees))
    other = hypothesis(530.0, "backlash", "motor_lag")
    found = Selection(BASE, (Round(again, [], [other]),), CHOSEN).best_fitted
    assert found.chosen is (CHOSEN if is_kept else again)


def test_what_does_far_better_or_swallows_the_commands_does_not_as_well():
    others = [
        hypothesis(720.0, "backlash", "actuation_delay"),
        hypothesis(499.0, "backlash", "torque_saturation", overriding=("torque_saturation",)),
    ]
    tried = Round(hypothesis(400.0, "backlash"), [], others)
    assert removal.substitutes(CHOSEN.candidates[1], CHOSEN, [tried], MARGIN) == []


def test_a_set_whose_values_were_settled_is_compared_by_the_errors_that_it_left_before():
    near = beside(actuation_delay=300.0)
    louder = CHOSEN._replace(autocorrelations=np.full(4, 60.0 * COLOUR))
    assert removal.substitutes(CHOSEN.candidates[1], louder, [near], MARGIN) == ["actuation_delay"]
    settled = louder._replace(temperature=60.0, unsettled=COLOUR)
    assert removal.substitutes(CHOSEN.candidates[1], settled, [near], MARGIN) == []


def test_a_set_that_swallows_the_commands_has_no_probability_beside_one_that_does_not():
    swallows = hypothesis(900.0, "torque_saturation", overriding=("torque_saturation",))
    tried = [Round(BASE, [], [CHOSEN, swallows])]
    beside_another = probabilities(Selection(BASE, tuple(tried), CHOSEN), SETTINGS)
    assert beside_another[("torque_saturation",)] == 0.0 and beside_another[CHOSEN.names] > 0.99
    alone = probabilities(Selection(BASE, tuple(tried), swallows), SETTINGS)
    assert alone[("torque_saturation",)] > 0.99


@pytest.mark.parametrize(
    ("rivals", "left"),
    [
        ({"actuation_delay": 495.0, "cogging": 493.0, "motor_lag": 491.0}, ("backlash",)),
        ({"actuation_delay": 495.0, "cogging": 493.0, "motor_lag": 480.0}, ("backlash", "dead_zone")),
        ({"actuation_delay": 495.0, "cogging": 493.0, "coulomb_friction": 495.0}, ("backlash", "dead_zone")),
    ],
    ids=["three others", "two others", "two others and kin"],
)
def test_a_second_effect_for_which_anything_would_do_is_not_named(rivals, left, monkeypatch):
    monkeypatch.setattr(
        FIT,
        lambda data, model, always, rest, rounds: hypothesis(400.0, *(c.name for c in rest)),
    )
    found = removal.without_unspecific(problem(), CHOSEN, [beside(**rivals)])
    assert found.names == left


def test_an_effect_that_gains_nothing_beside_another_goes(monkeypatch):
    scores = {("backlash",): 495.0, ("dead_zone",): 100.0}
    monkeypatch.setattr(
        FIT,
        lambda data, model, always, rest, rounds: hypothesis(
            scores[tuple(c.name for c in rest)], *(c.name for c in rest)
        ),
    )
    assert removal.without_redundant(problem(), CHOSEN, BASE).names == ("backlash",)
    scores["backlash",] = 300.0
    assert removal.without_redundant(problem(), CHOSEN, BASE).names == CHOSEN.names


def by_scores(scores):
    return lambda data, model, always, rest, rounds: hypothesis(
        scores[tuple(c.name for c in rest)], *(c.name for c in rest)
    )


@pytest.mark.parametrize("score", [-400.0, 0.0, 19.0])
def test_a_set_that_is_not_better_than_the_nominal_model_shrinks_to_nothing(score, monkeypatch):
    monkeypatch.setattr(FIT, by_scores({("backlash",): score, ("dead_zone",): score - 5.0}))
    at_once = hypothesis(score, "backlash", "dead_zone")
    assert removal.without_redundant(problem(), at_once, BASE) is BASE


def test_what_is_negligible_goes_however_sure_it_is(monkeypatch):
    monkeypatch.setattr(FIT, by_scores({("backlash",): 300.0, ("dead_zone",): 100.0}))
    sizes = {"backlash_size": 0.5, "dead_zone_size": 0.9 * SETTINGS.thresholds.min_effect_size * 0.5}
    trifle = hypothesis(
        500.0, "backlash", "dead_zone", model=SimpleNamespace(put=lambda values: values, value=sizes.get)
    )
    assert removal.without_redundant(problem(), trifle, BASE).names == ("backlash",)


def test_what_is_negligible_stays_where_what_is_left_diverges(monkeypatch):
    monkeypatch.setattr(FIT, by_scores({("backlash",): -np.inf, ("dead_zone",): 100.0}))
    sizes = {"backlash_size": 0.5, "dead_zone_size": 0.9 * SETTINGS.thresholds.min_effect_size * 0.5}
    trifle = hypothesis(
        500.0, "backlash", "dead_zone", model=SimpleNamespace(put=lambda values: values, value=sizes.get)
    )
    assert removal.without_redundant(problem(), trifle, BASE).names == trifle.names


THREE = hypothesis(500.0, "backlash", "dead_zone", "motor_lag")


@pytest.mark.parametrize(
    ("scores", "left", "fits"),
    [
        ({("backlash",): 495.0}, ("backlash",), 3 + 1),
        ({("backlash",): 300.0}, ("backlash", "motor_lag"), 3 + 1 + 2),
    ],
    ids=["of no use", "in the place of each other"],
)
def test_effects_of_no_use_go_together_but_for_those_that_stand_in_for_each_other(scores, left, fits, monkeypatch):
    """Either of two may go while the other is there, but not both: then the better set of the two is left."""
    scores |= {("backlash", "dead_zone"): 498.0, ("backlash", "motor_lag"): 499.0, ("dead_zone", "motor_lag"): 200.0}
    scores |= {("motor_lag",): 100.0, ("dead_zone",): 100.0}
    fitted = []

    def fit(data, model, always, rest, rounds):
        if rounds:  # each set but those that are clearly worse is fitted twice
            fitted.append(tuple(c.name for c in rest))
        return hypothesis(scores[tuple(c.name for c in rest)], *(c.name for c in rest))

    monkeypatch.setattr(FIT, fit)
    assert removal.without_redundant(problem(), THREE, BASE).names == left
    assert len(fitted) <= fits


def test_a_set_that_was_fitted_as_well_is_not_fitted_again(monkeypatch):
    monkeypatch.setattr(FIT, by_scores({}))  # any fit fails
    less = hypothesis(300.0, "backlash")
    known = [Round(hypothesis(499.5, *CHOSEN.names), [], [less])]
    assert removal.without(problem(), CHOSEN, CHOSEN.candidates[1], known) is less
    with pytest.raises(KeyError):
        removal.without(
            problem(), CHOSEN, CHOSEN.candidates[1], [known[0]._replace(base=hypothesis(490.0, *CHOSEN.names))]
        )


def test_what_was_weighed_beside_a_set_is_not_weighed_again(monkeypatch):
    candidates = (*CHOSEN.candidates, candidate("motor_lag"), candidate("cogging"))
    asked = Problem(None, None, (), candidates, SETTINGS)
    scored = [ScoredCandidate(each, 0.0, None, {}) for each in candidates[2:]]
    known = Round(hypothesis(500.5, *CHOSEN.names), scored, [])
    monkeypatch.setattr("twbal.diagnosis.problem.add_one", lambda *arguments: None)
    assert asked.add_to(CHOSEN, [known]) is known
    assert asked.add_to(CHOSEN, [known._replace(scored=scored[:1])]) is None  # not all of them were
    assert asked.add_to(CHOSEN, [known._replace(base=hypothesis(490.0, *CHOSEN.names))]) is None  # a worse fit


def test_no_more_effects_are_left_than_may_be_named(monkeypatch):
    monkeypatch.setattr(FIT, by_scores({("backlash",): 300.0, ("dead_zone",): 100.0}))
    one = replace(SETTINGS, max_effects=1)
    assert removal.without_redundant(problem(one), CHOSEN, BASE).names == ("backlash",)


def test_what_swallows_the_commands_is_chosen_only_where_nothing_else_is_worth_it():
    swallows = hypothesis(9000.0, "torque_saturation", overriding=("torque_saturation",))
    sane = hypothesis(300.0, "backlash")
    assert problem().best_inside([swallows, sane], BASE) is sane
    (free,) = problem().best_inside([swallows], BASE).at_bound
    assert free.name == "torque_saturation.size"


@pytest.fixture(scope="module")
def nominal_data(paper):
    return Data([synthetic_recording(paper, {}, seed=41, periods=400, tolerance=0.0)], 10)


@pytest.mark.parametrize("names", [(), ("coulomb_friction",)], ids=["no candidate", "one candidate"])
@pytest.mark.parametrize("most", [2, 0])
def test_few_candidates_or_none_are_enough(paper, nominal_data, names, most):
    few = [c for c in candidates_for(paper) if c.name in names]
    settings = replace(SETTINGS, max_effects=most)
    found = name_effects(nominal_data.recordings, paper, {}, few, settings)
    assert found.verdict is Verdict.NONE
    assert found.named_effects == ()


@pytest.mark.slow
def test_a_robot_equal_to_its_data_sheet_lacks_nothing_of_short_recordings(paper):
    with composing():
        settings = instantiate(compose("diagnose", ["episodes=e"]).diagnosis)
    recordings = [synthetic_recording(paper, {}, seed=s, periods=250, tolerance=0.0) for s in (42, 43)]
    assert name_effects(recordings, paper, {}, candidates_for(paper), settings).named_effects == ()


@pytest.mark.parametrize(("gain", "more", "low", "high"), [(300.0, 50.0, 0.9, 1.0), (9000.0, 50.0, 0.1, 0.5)])
def test_the_same_gain_says_less_beside_a_larger_one(gain, more, low, high):
    best = hypothesis(gain + more, "dead_zone", "ground_slope")
    selection = Selection(BASE, (Round(BASE, [], [hypothesis(gain, "dead_zone")]),), best)
    found = probabilities(selection, SETTINGS)
    assert sum(found.values()) == pytest.approx(1.0)
    assert found["dead_zone",] + found[best.names] > 0.999
    assert low < found[best.names] < high


def white_fit(score, *names):
    """A set with this score that leaves white errors."""
    found = hypothesis(score, *names)
    return found._replace(autocorrelations=np.ones(4), fit=found.fit._replace(cost=-score))


@pytest.mark.parametrize(("gain", "is_taken"), [(900.0, True), (400.0, False)])
def test_the_better_of_two_searches_stays(gain, is_taken, monkeypatch):
    once, twice = white_fit(500.0, "dead_zone"), white_fit(gain, "actuation_delay", "backlash")
    monkeypatch.setattr(tempered, "tempered_search", lambda *arguments: (twice, [Round(twice, [], [])]))
    monkeypatch.setattr(tempered, "without_redundant", lambda problem, chosen, base, rounds: chosen)
    first = Selection(BASE, (), once)
    found = tempered.search_again(problem(), first, lambda line: None)
    assert (found.chosen is twice) is is_taken
    assert (found is first) is not is_taken


@pytest.mark.parametrize(("autocorrelation", "is_taken"), [(1.0, False), (30.0, True)])
def test_a_set_at_a_bound_takes_no_finding_away(autocorrelation, is_taken, monkeypatch):
    """But it may take the place of a set that leaves so much that it is none."""
    once = white_fit(500.0, "dead_zone")._replace(autocorrelations=np.full(4, autocorrelation))
    twice = white_fit(900.0, "actuation_delay")
    twice = twice._replace(fit=twice.fit._replace(free_parameters=twice.candidates[0].free_parameters, model=AT_BOUND))
    assert twice.at_bound
    monkeypatch.setattr(name, "is_doubtful", lambda chosen, settings: True)
    for stage, found in (("select", once), ("search_again", twice)):
        monkeypatch.setattr(name, stage, lambda *arguments, found=found: Selection(BASE, (), found))
    for stage in ("grown", "exchanged"):
        monkeypatch.setattr(name, stage, lambda problem, selection, progress: selection)
    monkeypatch.setattr(name, "with_likeliest", lambda problem, selection, weights, progress: selection)
    found = name._search(problem(), BASE, BOUNDLESS, lambda line: None)
    assert (found.chosen is twice) is is_taken


@pytest.mark.parametrize(("falls", "searches"), [(8.9, ["search_again", "search_from_usual"]), (20.0, [])])
def test_short_recordings_are_a_doubt_and_what_another_search_fitted_is_kept(falls, searches, monkeypatch):
    once, on_the_way = white_fit(500.0, "dead_zone"), white_fit(700.0, "backlash")
    further = white_fit(900.0, "actuation_delay")
    further = further._replace(
        fit=further.fit._replace(free_parameters=further.candidates[0].free_parameters, model=AT_BOUND)
    )
    searched = []

    def search(stage):
        def found(problem, selection, progress):
            searched.append(stage)
            return Selection(BASE, (*selection.rounds, Round(BASE, [], [on_the_way])), further)

        return found

    monkeypatch.setattr(name, "is_doubtful", lambda chosen, settings: False)
    monkeypatch.setattr(name, "select", lambda *arguments: Selection(BASE, (), once))
    for stage in ("search_again", "search_from_usual"):
        monkeypatch.setattr(name, stage, search(stage))
    for stage in ("grown", "exchanged"):
        monkeypatch.setattr(name, stage, lambda problem, selection, progress: selection)
    monkeypatch.setattr(name, "with_likeliest", lambda problem, selection, weights, progress: selection)
    found = name._search(problem(), BASE, Extent(1.8, 1.0, 1.0, falls), lambda line: None)
    assert searched == searches
    assert found.chosen is once  # the further one is at a bound
    assert (on_the_way.names in {w.names for w in found.sets}) is bool(searches)
