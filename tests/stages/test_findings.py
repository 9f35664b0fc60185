from dataclasses import replace
from pathlib import Path

import pytest

from twbal.stages.findings import Findings, _note, summarise
from twbal.stages.learning import Learned
from twbal.stages.manifest import Manifest
from twbal.stages.predictions import Prediction, Verdict
from twbal.summary import Iteration, PolicyFile


def iteration(index, successes=0, real_cost=5.0, judged_success=1.0):
    return Iteration(
        index=index,
        real_episodes=index,
        real_samples=200 * index,
        real_seconds=4.0 * index,
        predicted_cost=3.0,
        real_cost=real_cost,
        successes=successes,
        trials=0 if real_cost is None else 10,
        coverage95=None,
        fit_s=1.0,
        search_s=1.0,
        drift_m=None,
        judged_success=judged_success,
        policy=PolicyFile("policy.pt", "0" * 64),
        note="",
    )


def prediction(origin):
    verdict = Verdict(origin, 3.0, 1.0, 0.1)
    return Prediction(("tilt",), (), verdict, (verdict,))


def learned(index, confirms=False, searches=1):
    search = Manifest("optimise-policy", True, "", 0, "", {}, (), {}, "", 1.0)
    return Learned(index, (), (search,) * searches, (), Path("policy"), Path("model.pt"), None, confirms)


def best(*iterations):
    found = [Findings(each, prediction("random"), ()) for each in iterations]
    return summarise(found, (), "paper", 0, 1.0).best_iteration


def test_the_best_policy_has_most_successes():
    assert best(iteration(0, 3, 2.0), iteration(1, 10, 9.0), iteration(2, 9, 1.0)) == 1


def test_of_equal_successes_the_lowest_cost_on_the_robot_decides():
    assert best(iteration(0, 3), iteration(1, 10, 6.0), iteration(2, 10, 5.0), iteration(3, 10, 7.0)) == 2


def test_without_trials_the_newest_of_the_best_judged_is_kept():
    judged = [0.5, 1.0, 1.0, 0.9]
    assert best(*(iteration(i, 0, None, success) for i, success in enumerate(judged))) == 2


@pytest.mark.parametrize(("successes", "worse"), [(10, False), (9, True), (0, True)])
def test_an_update_that_made_things_worse_is_named(successes, worse):
    before = [iteration(0, 2), replace(iteration(1, 10), real_cost=4.0)]
    note = _note(learned(2), prediction("search from random"), successes, before)
    assert note == ("Worse on the robot than policy 1 (10 of 10), which is kept." if worse else "")


def test_a_search_that_found_nothing_better_is_named():
    note = _note(learned(1), prediction("policy 0"), 10, [iteration(0, 10)])
    assert note == "The search found nothing better than policy 0, which was driven again."


@pytest.mark.parametrize(("index", "searches", "said"), [(1, 1, False), (1, 3, True), (0, 3, False)])
def test_policies_that_fell_in_rehearsal_are_told_of(index, searches, said):
    note = _note(learned(index, searches=searches), prediction("search from random"), 10, [])
    assert note == ("Searched 3 times: what came before did not balance in the mended simulation." if said else "")


def test_a_policy_that_is_driven_for_the_models_sake_is_not_called_a_failed_search():
    note = _note(learned(1, confirms=True), prediction("policy 0"), 10, [iteration(0, 10)])
    assert note == "The policy of the iteration before, which balances; the model has learned from driving it."
