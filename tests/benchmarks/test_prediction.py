"""Figures of predictions against what they mean, worked out trial by trial, and files that note less."""

import json
import runpy
from pathlib import Path

import numpy as np
import pytest

from benchmarks.hidden_robots.prediction import (
    Forecast,
    Share,
    bands_hold,
    brier_of_knowing_more,
    costs_hold,
    diagram,
    figures,
    forecasts,
    main,
    prediction_table,
    read,
    reliability,
    reliability_table,
)
from benchmarks.hidden_robots.record import iteration_records
from benchmarks.hidden_robots.reference import Rules
from twbal.core.evaluation import SuccessCriterion

SCRIPT = Path(__file__).parents[2] / "scripts" / "readme.py"


def step(successes=10, trials=10, **noted):
    shown = [{"default": {"succeeded": i < successes}} for i in range(trials)]
    return {"trials": shown, "predicted_cost": 10.0, "real_cost": 10.0, "coverage95": 0.9, **noted}


def robot(*steps):
    return {"seed": 1, "iterations": list(steps)}


def family(*robots, name="hard"):
    return {"family": name, "robots": list(robots)}


def noted(probability, successes, **more):
    return step(successes, success_probability=probability, crps_ratio=1.2, reason="expected better", **more)


def test_the_brier_score_is_the_mean_square_over_all_trials():
    found = [Forecast(0.2, 1, 10), Forecast(0.99, 10, 10), Forecast(0.6, 2, 4)]
    given = np.concatenate([np.full(f.trials, f.probability) for f in found])
    outcome = np.concatenate([np.arange(f.trials) < f.successes for f in found])
    score = reliability(found)
    assert score.brier == pytest.approx(((given - outcome) ** 2).mean())
    assert score.brier_of_share == pytest.approx(((outcome.mean() - outcome) ** 2).mean())
    assert score.improvement == pytest.approx(1.0 - score.brier / score.brier_of_share)


def test_always_giving_the_overall_share_is_no_improvement_and_knowing_is_all_of_it():
    assert reliability([Forecast(0.6, 2, 10), Forecast(0.6, 10, 10)]).improvement == pytest.approx(0.0)
    assert reliability([Forecast(0.0, 0, 10), Forecast(1.0, 10, 10)]).improvement == pytest.approx(1.0)
    assert reliability([Forecast(0.9, 10, 10)]).improvement is None  # nobody can do better than that share
    assert reliability([]) is None


def test_the_best_forecaster_knows_the_share_of_a_sheet_before_a_robot_drives_and_later_all_outcomes():
    def learned(first, last):
        return robot(noted(0.7, first, index=0), noted(0.9, last, index=1))

    paper = [family(learned(0, 9)), family(learned(10, 10), name="moderate")]
    knowing = np.repeat([0.5, 0.5, 0.9, 1.0], 10)
    outcome = np.concatenate([np.arange(10) < successes for successes in (0, 10, 9, 10)])
    assert brier_of_knowing_more(paper) == pytest.approx(((knowing - outcome) ** 2).mean())
    other_sheet = [paper[0], family(learned(10, 10), name="regbot")]
    assert brier_of_knowing_more(other_sheet) == pytest.approx(0.9 * 0.1 / 4)
    assert brier_of_knowing_more([family(robot(step()))]) is None


def test_policies_that_refute_their_probability_fail_more_than_half_of_their_trials():
    found = [Forecast(0.95, 4, 10), Forecast(0.95, 5, 10), Forecast(0.9, 0, 10), Forecast(0.99, 10, 10)]
    assert reliability(found).refuted == Share(1, 3)


def test_forecasts_that_are_drawn_from_their_probabilities_lie_on_the_diagonal_of_the_diagram():
    rng = np.random.default_rng(5)
    found = [Forecast(p, int(rng.binomial(10, p)), 10) for p in rng.uniform(0.0, 1.0, 4000)]
    points = diagram(found)
    assert [(p.low, p.high) for p in points] == [(i / 10, (i + 1) / 10) for i in range(10)]
    assert all(p.real == pytest.approx(p.expected, abs=0.05) for p in points)
    assert all(p.low <= p.expected <= p.high for p in points)
    assert sum(p.policies for p in points) == 4000
    expected = np.mean([f.probability * (1.0 - f.probability) for f in found])
    assert reliability(found).brier == pytest.approx(expected, abs=0.01)


def test_certainty_belongs_to_the_last_bin():
    (point,) = diagram([Forecast(1.0, 9, 10)])
    assert (point.low, point.high, point.real) == (0.9, 1.0, 0.9)


def test_each_decision_counts_once_and_a_policy_that_stays_for_its_model_decides_nothing():
    again = noted(0.99, 10) | {"reason": "new model"}
    kept = noted(0.8, 5) | {"reason": "kept", "same_policy_as": 0}
    untried = noted(0.5, 0) | {"trials": []}
    assert forecasts([robot(noted(0.3, 2), kept, noted(0.9, 10), again), robot(untried, step())]) == [
        Forecast(0.3, 2, 10),
        Forecast(0.8, 5, 10),
        Forecast(0.9, 10, 10),
    ]


def test_costs_hold_within_their_limits_only_and_where_both_are_known():
    costs = [8.0, 12.5, 7.9, 12.6]
    steps = [step(predicted_cost=cost) for cost in costs] + [step(predicted_cost=None), step(real_cost=None)]
    assert costs_hold(steps) == Share(2, 4)


@pytest.mark.parametrize(
    ("coverage", "ratio", "holds"), [(0.9, 2.0, True), (0.9, 2.1, False), (1.0, 1.0, False), (0.84, 1.0, False)]
)
def test_bands_hold_if_they_cover_what_they_should_and_are_sharp(coverage, ratio, holds):
    assert bands_hold([step(coverage95=coverage, crps_ratio=ratio)]) == Share(int(holds), 1)


def test_results_of_older_versions_give_a_dash():
    found = figures([family(robot(step(), step()))])
    assert found["last predicted over real cost 0.8-1.25"] == "1 of 1 (100%)"
    for name in (
        "last coverage 0.85-0.99, CRPS at most 2 × that of the trials",
        "Brier score",
        "below that of the overall share by",
    ):
        assert found[name] == "-"
    assert reliability_table([{"family": "hard", "robots": [robot(step())]}]) == ["Not measured yet."]


def test_the_last_iteration_is_told_apart_from_the_earlier_ones():
    found = figures([family(robot(noted(0.5, 0, predicted_cost=40.0), noted(0.9, 10)))])
    assert found["last predicted over real cost 0.8-1.25"] == "1 of 1 (100%)"
    assert found["earlier iterations with 0.8-1.25"] == "0 of 1 (0%)"


def test_the_table_has_a_column_for_each_family_and_one_for_all():
    families = [{"family": name, "robots": [robot(noted(0.5, 5))]} for name in ("hard", "moderate")]
    lines = prediction_table(families)
    assert lines[0] == "| figure | hard | moderate | all |"
    assert "| robots | 1 | 1 | 2 |" in lines
    assert {line.count("|") for line in lines} == {5}


def test_results_are_read_where_they_are_there(tmp_path):
    (tmp_path / "hidden_robots_hard.json").write_text(json.dumps({"family": "hard", "robots": []}))
    (tmp_path / "hidden_robots_hard_pilco.json").write_text(json.dumps({"family": "hard", "robots": [robot(step())]}))
    assert [family["robots"] for family in read(["hard", "esp32"], "default", tmp_path)] == [[]]
    assert len(read(["hard", "esp32"], "pilco", tmp_path)[0]["robots"]) == 1


def test_unknown_settings_are_refused():
    with pytest.raises(SystemExit, match="unknown settings: robot"):
        main(["robot=3"])
    with pytest.raises(SystemExit, match="No results of nowhere"):
        main(["families=nowhere"])


def test_a_page_fills_a_table_from_several_files_of_which_some_are_there(tmp_path):
    script = runpy.run_path(str(SCRIPT))
    page = "<!-- table prediction of hidden_robots_hard hidden_robots_none --><!-- end -->"
    script["filled"].__globals__["RESULTS"] = tmp_path
    assert "Not measured yet." in script["filled"](page)
    results = {"family": "hard", "robots": [robot(noted(0.5, 5))]}
    (tmp_path / "hidden_robots_hard.json").write_text(json.dumps(results))
    assert "| Brier score | 0.250 | 0.250 |" in script["filled"](page)


def test_a_record_keeps_what_was_predicted_and_leaves_open_what_an_older_run_does_not_note(tmp_path):
    old = {"index": 0, "real_seconds": 0.0, "trial_seconds": 5.0, "predicted_cost": 6.0, "real_cost": 91.0}
    old |= {"coverage95": 0.05, "fit_s": 1.0, "search_s": 2.0}
    told = {"log_density": 1.0, "crps": 0.02, "crps_of_trials": 0.01, "crps_ratio": 2.0, "success_probability": 0.8}
    told |= {"reason": "first", "same_policy_as": None, "successes": 4}
    told |= {"judged_success": 0.9, "predicted_by": "model"}
    rule = SuccessCriterion(tilt_limit=0.5, settled_tilt_limit=0.2, settle_step=5, steps=10)
    first, second = iteration_records(tmp_path, {"iterations": [old, old | told]}, Rules(rule, rule))
    assert first == old | dict.fromkeys(told) | {"trials": []}
    assert second == old | told | {"trials": []}
