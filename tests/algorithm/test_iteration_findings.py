"""What is made of the files of a run: which policy is best, and what is noted of each iteration."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from falling import falls_at_once

import twbal
from twbal.algorithm.in_memory import InMemory, MadePolicy
from twbal.algorithm.iteration import Base, Basis, DiagnosisOutcome, Iteration, PolicyFile, Search
from twbal.algorithm.iteration_findings import IterationFindings, _note, _predicted_by, _with_parts, findings, summarise
from twbal.algorithm.learned import LearnedPolicy, RunResult
from twbal.algorithm.prediction import Assessment, PredictedBy, Prediction
from twbal.algorithm.tables import iterations_table, trials_table
from twbal.core.evaluation import PlaceBy, SuccessCriterion, TrialVerdict
from twbal.core.gaussian import Gaussian
from twbal.search.predictor import Predictor
from twbal.viz.run_figures import pictures
from twbal.viz.run_page import RunSetup, write_report


def iteration(index, successes=0, real_cost=5.0, judged_success=1.0, **changes):
    found = Iteration(
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
        policy=PolicyFile("policy.pt", f"{index:064x}"),
        note="",
        search=Search.FOUND,
        used_worst=0.5,
        oscillation_worst=0.01,
    )
    return replace(found, **changes)


RULE = SuccessCriterion(tilt_limit=0.5, settled_tilt_limit=0.2, settle_step=50, steps=100)


def best(*iterations, oscillation_limit=None):
    found = [IterationFindings(each, None, ()) for each in iterations]
    return summarise(found, (), "paper", 0, 1.0, RULE, oscillation_limit).best_iteration


def test_the_best_policy_has_most_successes():
    assert best(iteration(0, 3, 2.0), iteration(1, 10, 9.0), iteration(2, 9, 1.0)) == 1


def test_of_equal_successes_the_lowest_cost_on_the_robot_decides():
    assert best(iteration(0, 3), iteration(1, 10, 6.0), iteration(2, 10, 5.0), iteration(3, 10, 7.0)) == 2


def test_of_equal_successes_one_under_which_the_tilt_hardly_oscillates_comes_before_a_cheaper_one():
    rocking, steady = iteration(0, 10, 5.0, oscillation_worst=0.11), iteration(1, 10, 6.0, oscillation_worst=0.04)
    assert best(rocking, steady, oscillation_limit=0.09) == 1
    assert best(rocking, steady) == 0
    assert best(rocking, iteration(1, 9, 6.0, oscillation_worst=0.04), oscillation_limit=0.09) == 0


def test_of_policies_that_always_succeed_one_that_was_searched_for_margin_comes_before_a_cheaper_one():
    first, with_margin = iteration(0, 10, 5.0), iteration(1, 10, 6.0, margin=0.7)
    assert best(first, with_margin) == 1
    assert best(first, replace(with_margin, oscillation_worst=0.11), oscillation_limit=0.09) == 0
    assert best(iteration(0, 9, 5.0), iteration(1, 9, 6.0, margin=0.7)) == 0


def test_a_policy_that_comes_close_to_failing_is_not_the_best_whatever_its_margin():
    first, with_margin = iteration(0, 10, 5.0, used_worst=0.7), iteration(1, 10, 4.0, margin=0.7, used_worst=0.9)
    assert best(first, with_margin) == 0
    assert best(replace(first, used_worst=0.95), with_margin) == 1
    assert best(first, replace(with_margin, used_worst=0.78)) == 1


def test_a_trial_that_ended_early_used_all_of_a_limit():
    fell, stayed = iteration(0, 0, 99.0, used_worst=None), iteration(1, 0, 6.0, used_worst=1.4, oscillation_worst=0.2)
    assert best(fell, stayed) == best(fell, stayed, oscillation_limit=0.09) == 1


def test_a_policy_that_was_driven_again_is_ranked_by_its_first_trials():
    """As by these it was chosen to be driven again; that it failed counts whenever it did."""
    first, with_margin = iteration(0, 10, 5.0, used_worst=0.85), iteration(1, 10, 4.0, margin=0.7, used_worst=0.84)
    again = iteration(2, 10, 4.0, same_policy_as=1, used_worst=0.86, search=Search.NOT_MADE)
    assert best(first, with_margin, again) == 1
    assert best(first, with_margin, replace(again, successes=9)) == 0


def test_without_trials_the_newest_of_the_best_judged_is_kept():
    judged = [0.5, 1.0, 1.0, 0.9]
    assert best(*(iteration(i, 0, None, success) for i, success in enumerate(judged))) == 2


def test_a_policy_is_of_the_iteration_that_had_it_first_though_it_cost_less_the_second_time():
    assert best(iteration(0, 10, 8.7), iteration(1, 10, 8.3, same_policy_as=0, search=Search.NOT_MADE)) == 0


def test_all_trials_of_a_policy_count():
    again = iteration(2, 2, same_policy_as=1, search=Search.KEPT)
    assert best(iteration(0, 7), iteration(1, 10), again) == 0
    assert best(iteration(0, 5), iteration(1, 10), again) == 1


def test_trials_of_before_do_not_count_twice():
    stays = iteration(2, 10, 3.0, same_policy_as=1, trials_of=1, search=Search.KEPT)
    again = iteration(3, 4, 9.0, same_policy_as=1, search=Search.NOT_MADE)
    assert best(iteration(0, 7, 6.5), iteration(1, 10), stays, again) == 0  # 14 of 20, at a mean cost of 7
    assert best(iteration(0, 7, 7.5), iteration(1, 10), stays, again) == 1


@pytest.mark.parametrize(("successes", "worse"), [(10, False), (9, True), (0, True)])
def test_an_update_that_made_things_worse_is_named(successes, worse):
    before = [iteration(0, 2), iteration(1, 10, real_cost=4.0)]
    note = _note(iteration(2, successes), before, 1)
    assert note == ("Worse on the robot than policy 1 (10 of 10)." if worse else "")


def test_a_search_that_found_nothing_better_is_named():
    note = _note(iteration(1, 10, same_policy_as=0, search=Search.KEPT), [iteration(0, 10)], 1)
    assert note == "The same policy as iteration 0: the search found nothing better."


def test_a_policy_that_was_not_driven_again_says_whose_trials_are_shown():
    stays = iteration(2, 10, same_policy_as=1, trials_of=1, search=Search.KEPT)
    note = _note(stays, [iteration(0, 0), iteration(1, 10)], 1)
    assert note == (
        "The same policy as iteration 1: the search found nothing better. It was not tested again: the trials "
        "shown are those of iteration 1."
    )


def test_policy_0_that_an_earlier_round_in_simulation_found_is_no_repetition():
    assert _note(iteration(0, 10, search=Search.KEPT), [], 2) == ""


@pytest.mark.parametrize(
    ("diagnosis", "searches", "said"),
    [(DiagnosisOutcome.USED, 1, False), (DiagnosisOutcome.USED, 3, True), (DiagnosisOutcome.NOT_MADE, 3, False)],
)
def test_policies_that_fell_in_rehearsal_are_told_of(diagnosis, searches, said):
    note = _note(iteration(1, 10, diagnosis=diagnosis), [], searches)
    assert note == ("Searched 3 times: what came before did not balance in the corrected simulation." if said else "")


def test_the_base_that_g_was_learned_on_is_told_with_its_lead_in_evidence():
    log_evidences = {"given": 10.0, "identified": 138.4, "none": 110.0}
    note = _note(iteration(1, 10, base=Base.IDENTIFIED, log_evidences=log_evidences), [iteration(0)], 1)
    assert note == (
        "g was learned on top of the f of the identified simulation: the log evidence of the rollouts is higher by 28 "
        "than without a simulation and by 128 than on top of the f of the given simulation."
    )
    note = _note(iteration(1, 10, base=Base.NONE, log_evidences={"given": 9.0, "none": 11.0}), [iteration(0)], 1)
    assert note == (
        "g was learned without a simulation: the log evidence of the rollouts is higher by 2 than on top of the f of "
        "the given simulation."
    )


def test_a_policy_that_is_driven_for_the_models_sake_is_not_called_a_failed_search():
    note = _note(iteration(1, 10, same_policy_as=0, search=Search.NOT_MADE), [iteration(0, 10)], 1)
    assert note == "The same policy as iteration 0; only the model is new, from 4.0 s more driving."


def verdict(farthest, in_place=True, by=PlaceBy.POSE, **changes):
    return TrialVerdict(True, True, in_place, None, by, farthest, 0.04, 0.1, 10.0)._replace(**changes)


def test_parts_are_counted_and_distances_are_the_median_and_the_worst():
    verdicts = [
        verdict(0.1),
        verdict(0.3, False, settled=False),
        verdict(0.2, oscillation=0.12),
        verdict(None, False, upright=False),
    ]
    found = _with_parts(iteration(0, 2), verdicts)
    assert (found.upright, found.settled, found.in_place, found.quiet) == (3, 3, 2, None)
    assert (found.farthest_median_m, found.farthest_worst_m, found.place_by) == (0.2, 0.3, PlaceBy.POSE)
    assert (found.command_change, found.oscillation, found.oscillation_worst) == (0.04, 0.1, 0.12)


def test_a_place_that_odometry_told_in_one_trial_is_not_said_to_be_the_true_one():
    assert _with_parts(iteration(0), [verdict(0.1), verdict(0.1, by=PlaceBy.ODOMETRY)]).place_by is PlaceBy.ODOMETRY


def test_without_trials_no_part_is_noted():
    none = _with_parts(iteration(0, 0, None), [])
    assert (none.upright, none.place_by, none.farthest_worst_m, none.oscillation) == (None,) * 4


def predicted(*predictors):
    best = Assessment("policy 0", 9.0, 1.0, 0.1, 0)
    return Prediction(("tilt",), (Gaussian(np.zeros(1), np.eye(1)),), best, (best,), predictors)


def test_which_prediction_is_taken_is_said_beside_the_best_of_the_other_kind():
    robots = [PredictedBy(Predictor.ROBOTS, 4.2, 0.02, "mean parameters"), PredictedBy(Predictor.ROBOTS, 5.0, 0.03)]
    model = PredictedBy(Predictor.MODEL, 17.5, 0.4)
    assert _predicted_by(predicted(*robots, model)) == (
        "Of 3 predictions that of the sampled robots (mean parameters) is taken: its CRPS on the calibration "
        "rollouts is the lowest (0.02; that of the model 0.4, with an expected cost of 17.5)."
    )


def test_nothing_is_said_where_there_was_no_choice_or_nothing_to_score():
    assert _predicted_by(None) == ""
    assert _predicted_by(predicted(PredictedBy(Predictor.MODEL, 4.2, 0.02))) == ""
    assert _predicted_by(predicted(PredictedBy(Predictor.ROBOTS, 4.2), PredictedBy(Predictor.MODEL, 17.5))) == ""


def found_of(trials, setup):
    """What is found of a policy that was predicted to stand still, from its trials."""
    names = setup.search.channels.names
    states = tuple(Gaussian(np.zeros(len(names)), np.eye(len(names))) for _ in range(21))
    best = Assessment("policy 0", 9.0, 1.0, 0.1, None)
    said = Prediction(names, states, best, (best,), (PredictedBy(Predictor.MODEL, 4.0),))
    made = MadePolicy(Path("policy"), None, 64 * "0", said)
    steps = InMemory(None, setup, lambda line: None)
    result = RunResult((), (LearnedPolicy(0, made, Basis.SIMULATION, trials=trials),))
    return findings(result, steps, setup.measures)


def test_trials_that_all_end_at_their_first_sample_leave_nothing_to_compare_with_a_prediction(tmp_path):
    setup = twbal.setup("paper")
    names = setup.search.channels.names
    ended, fell = (
        replace(falls_at_once(setup.simulation.robot, steps), channels=names, states=np.zeros((steps + 1, len(names))))
        for steps in (0, 3)
    )
    found = found_of((ended, ended), setup)
    (each,) = found
    assert (each.iteration.coverage95, each.iteration.crps, each.iteration.log_density) == (None, None, None)
    assert (each.iteration.trials, each.iteration.successes, each.iteration.real_cost) == (2, 0, 100.0)
    summary = summarise(found, (), "paper", 0, 1.0, setup.rule, 0.09)
    assert summary.best_iteration == 0
    assert "0 of 2" in iterations_table(summary)[-1]
    assert trials_table(summary)[-1].split()[:3] == ["*", "0", "2"]
    drawn = pictures(summary, found, setup.measures, 0.02)
    write_report(tmp_path / "report.html", summary, RunSetup(True, setup.rule, 0.02, [], []), drawn, "")
    assert "0 of 2 trials succeeded" in (tmp_path / "report.html").read_text()
    (one_went_on,) = found_of((ended, fell), setup)
    assert one_went_on.iteration.coverage95 == 1.0
    assert one_went_on.iteration.crps is not None
