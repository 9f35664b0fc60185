"""Why a policy is driven follows from what its search said of the candidates."""

from dataclasses import replace

import numpy as np
import pytest

from twbal.algorithm.iteration import Iteration, PolicyFile, Reason
from twbal.algorithm.prediction import Assessment, PredictedBy, Prediction
from twbal.algorithm.reasons import reason_for, reason_in_words
from twbal.core.gaussian import Gaussian
from twbal.search.predictor import Predictor


def iteration(index: int, same_policy_as: int | None = None) -> Iteration:
    policy = PolicyFile("policy.pt", f"{index:064x}")
    found = Iteration(index, index, 200, 4.0, 3.0, 5.0, 0, 10, None, 1.0, 1.0, None, 1.0, policy, "")
    return replace(found, same_policy_as=same_policy_as)


def assessment(share: float, earlier: int | None) -> Assessment:
    origin = "search" if earlier is None else f"policy {earlier}"
    return Assessment(origin, 3.0, share, 0.1, earlier, (60 * share + 0.5) / 61)


def prediction(*candidates: Assessment) -> Prediction:
    """With the candidates in their order."""
    states = (Gaussian(np.zeros(1), np.eye(1)),) * 2
    predicted = (PredictedBy(Predictor.MODEL, candidates[0].cost),)
    return Prediction(("tilt",), states, candidates[0], candidates, predicted)


BETTER = prediction(assessment(0.9, None), assessment(0.25, 1), assessment(0.0, 0))
AS_LIKELY = prediction(assessment(0.88, None), assessment(0.92, 1))
KEPT = prediction(assessment(0.9, 1), assessment(0.8, None))
MARGIN = prediction(
    replace(assessment(0.9, None), margin=0.7), replace(assessment(1.0, 1), margin=0.45), assessment(0.0, 0)
)
MARGIN_ALONE = prediction(replace(assessment(0.9, None), margin=0.7), assessment(0.8, None))
ALONE = prediction(assessment(0.9, None), assessment(0.8, None))


@pytest.mark.parametrize(
    ("found", "reason"),
    [
        (BETTER, Reason.BETTER),
        (AS_LIKELY, Reason.AS_LIKELY),
        (KEPT, Reason.KEPT),
        (ALONE, Reason.ALONE),
        (MARGIN, Reason.MARGIN),
        (MARGIN_ALONE, Reason.MARGIN),
        (None, None),
    ],
)
def test_an_update_drives_what_its_search_ranked_first(found, reason):
    assert reason_for(2, False, found) is reason


def test_the_first_policy_and_one_that_stays_for_its_model_are_no_choice():
    assert reason_for(0, False, KEPT) is Reason.FIRST
    assert reason_for(2, True, KEPT) is Reason.MODEL


def test_the_sentence_tells_both_probabilities_and_names_the_policy_by_its_first_iteration():
    before = [iteration(0), iteration(1, same_policy_as=0)]
    assert reason_in_words(Reason.BETTER, BETTER, before) == (
        "Expected to be better: to succeed with probability 0.89, policy 0 with 0.25."
    )
    assert reason_in_words(Reason.AS_LIKELY, AS_LIKELY, before) == (
        "Expected to succeed about as often as policy 0 (probability 0.87 and 0.91); chosen as it ranks first by how "
        "the sampled robots balance."
    )


def test_a_policy_that_was_searched_for_margin_tells_of_how_many_changed_robots_succeed():
    assert reason_in_words(Reason.MARGIN, MARGIN, [iteration(0), iteration(1)]) == (
        "Searched for more margin: it succeeds with 70% of sampled robots that changed, policy 1 with 45%."
    )


def test_where_all_earlier_policies_were_set_aside_a_policy_with_margin_says_so():
    assert reason_in_words(Reason.MARGIN, MARGIN_ALONE, [iteration(0)]) == (
        "Searched for more margin: it succeeds with 70% of sampled robots that changed. No earlier policy was a "
        "candidate: under each of them the robot fell in a trial, or its tilt oscillated in the worst one."
    )


def test_a_policy_with_margin_that_holds_no_more_changed_robots_ranks_first_for_another_reason():
    fewer = replace(MARGIN, best=replace(MARGIN.best, margin=0.4))
    assert reason_in_words(Reason.MARGIN, fewer, [iteration(0), iteration(1)]).endswith(
        "policy 1 with 45%; it ranks first as the robots use less of the limits under it."
    )


def test_where_no_earlier_policy_was_a_candidate_that_is_said():
    assert "each was driven twice" in reason_in_words(Reason.ALONE, ALONE, [iteration(0)])


@pytest.mark.parametrize("reason", [Reason.FIRST, Reason.KEPT, Reason.MODEL, None])
def test_without_a_choice_of_a_new_policy_nothing_is_said(reason):
    assert reason_in_words(reason, KEPT, [iteration(0), iteration(1)]) == ""
    assert reason_in_words(reason, None, []) == ""


def test_an_older_prediction_without_probabilities_gives_a_reason_but_no_numbers():
    old = prediction(Assessment("search", 3.0, 0.9, 0.1, None), Assessment("policy 0", 3.0, 0.2, 0.1, 0))
    assert reason_for(1, False, old) is Reason.BETTER
    assert reason_in_words(Reason.BETTER, old, [iteration(0)]) == ""


TWICE = "Policy 0, driven twice already, was no candidate."


def test_a_policy_that_was_driven_twice_is_said_to_be_no_candidate():
    """It may be expected to do better than the one that is driven."""
    before = [iteration(0), iteration(1, same_policy_as=0), iteration(2)]
    better = prediction(assessment(0.9, None), assessment(0.25, 2))
    assert reason_in_words(Reason.BETTER, better, before) == (
        f"Expected to be better: to succeed with probability 0.89, policy 2 with 0.25. {TWICE}"
    )
    as_likely = prediction(assessment(0.88, None), assessment(0.92, 2))
    assert reason_in_words(Reason.AS_LIKELY, as_likely, before).endswith(f"the sampled robots balance. {TWICE}")
    margin = prediction(replace(assessment(0.9, None), margin=0.7), replace(assessment(1.0, 2), margin=0.45))
    assert reason_in_words(Reason.MARGIN, margin, before).endswith(f"policy 2 with 45%. {TWICE}")


def test_several_policies_that_were_driven_twice_are_all_named():
    before = [iteration(0), iteration(1, 0), iteration(2), iteration(3, 2), iteration(4)]
    better = prediction(assessment(0.9, None), assessment(0.25, 4))
    assert reason_in_words(Reason.BETTER, better, before).endswith(
        "policy 4 with 0.25. Policies 0 and 2, driven twice already, were no candidates."
    )


def test_where_some_were_driven_twice_and_the_others_set_aside_both_are_said():
    before = [iteration(0), iteration(1, 0), iteration(2)]
    assert "some were driven twice already, and under each of the others" in reason_in_words(
        Reason.MARGIN, MARGIN_ALONE, before
    )
