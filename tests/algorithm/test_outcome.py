"""Sentences and the table say what the summary says, and nothing else."""

import dataclasses
import re
from math import radians

import pytest

from twbal.algorithm.iteration import Basis, Iteration, PolicyFile, Reason, Search
from twbal.algorithm.outcome import doubts, driving, headline, rule_in_words, summary_table
from twbal.algorithm.summary import SimData, Summary
from twbal.core.errors import DataError
from twbal.core.evaluation import PlaceBy, SuccessCriterion

LIMIT = radians(30)


def iteration(index: int, successes: int, **changes: object) -> Iteration:
    fresh = Iteration(
        index=index,
        real_episodes=index,
        real_samples=60 * index,
        real_seconds=1.2 * index,
        predicted_cost=20.0,
        real_cost=22.0,
        successes=successes,
        trials=10,
        coverage95=0.9,
        fit_s=2.5,
        search_s=11.0,
        drift_m=0.4,
        judged_success=successes / 10,
        policy=PolicyFile(f"iteration_{index}/policy.pt", f"{index:064x}"),
        note="",
        trial_seconds=50.0,
        basis=Basis.CORRECTED if index else Basis.SIMULATION,
        search=Search.FOUND,
        tilt_band_median=radians(2),
        tilt_band_widest=radians(3),
    )
    return dataclasses.replace(fresh, **changes)  # type: ignore[arg-type]


def summary(*iterations: Iteration, best: int = 0) -> Summary:
    return Summary("paper", 7, 200.5, SimData(20, 800), iterations, best, LIMIT)


RECALIBRATED = iteration(1, 10, same_policy_as=0, search=Search.NOT_MADE)
SOLVED_AT_ONCE = summary(iteration(0, 10), RECALIBRATED)
SOLVED_LATER = summary(iteration(0, 0), iteration(1, 4), iteration(2, 10), best=2)
SOME = summary(iteration(0, 0), iteration(1, 1), best=1)
NONE = summary(iteration(0, 0), iteration(1, 0))


@pytest.mark.parametrize(
    ("about", "said"),
    [
        (
            SOLVED_AT_ONCE,
            "The robot is balanced: policy 0 succeeded in 20 of 20 trials. Nothing was learned from the robot for it. "
            "In a trial it rolled 0.4 m away (median).",
        ),
        (
            SOLVED_LATER,
            "The robot is balanced: policy 2 succeeded in 10 of 10 trials. It was learned from 2.4 s of driving the "
            "robot, in 2 updates; policy 0 succeeded in 0 of 10. In a trial it rolled 0.4 m away (median).",
        ),
        (
            SOME,
            "The robot is not reliably balanced: the best, policy 1, succeeded in 1 of 10 trials. It was learned from "
            "1.2 s of driving the robot, in 1 update; policy 0 succeeded in 0 of 10.",
        ),
        (NONE, "The robot is not balanced: no policy succeeded in any of 20 trials."),
    ],
)
def test_the_headline_says_whether_it_balances_by_what_policy_and_what_that_took(about: Summary, said: str) -> None:
    assert headline(about) == said


def test_a_policy_that_failed_once_more_is_not_called_balanced_without_more_words() -> None:
    about = summary(iteration(0, 10), dataclasses.replace(RECALIBRATED, successes=9))
    assert headline(about).startswith("The robot is balanced in most trials: policy 0 succeeded in 19 of 20 trials.")


def test_without_trials_nothing_is_claimed() -> None:
    untried = iteration(0, 0, trials=0, real_cost=None, coverage95=None, trial_seconds=0.0)
    assert headline(summary(untried)) == (
        "No trial was driven, so nothing is known of how policy 0 balances the robot."
    )
    assert doubts(untried, LIMIT) == []


def test_driving_to_learn_and_in_trials_are_both_told() -> None:
    assert driving(SOLVED_LATER) == "The robot was driven for 2.4 s to learn, and for 150.0 s in trials."
    unknown = summary(iteration(0, 3, trial_seconds=None))
    assert driving(unknown) == "The robot was driven for 0.0 s to learn."


@pytest.mark.parametrize(
    ("predicted", "real", "warned"),
    [(60.7, 8.1, True), (2.9, 48.0, True), (4.6, 2.3, False), (8.9, 3.0, False), (0.1, 0.9, False)],
)
def test_costs_that_part_are_warned_of(predicted: float, real: float, warned: bool) -> None:
    found = doubts(iteration(0, 10, predicted_cost=predicted, real_cost=real), LIMIT)
    told = f"The prediction of iteration 0 is far off: it expected a cost of {predicted}, the robot's was {real}."
    assert found == ([told] if warned else [])


@pytest.mark.parametrize(("widest", "warned"), [(100, True), (31, True), (29, False)])
def test_a_band_wider_than_the_tilt_limit_is_no_merit_however_much_it_holds(widest: float, warned: bool) -> None:
    found = doubts(iteration(1, 10, coverage95=1.0, tilt_band_widest=radians(widest)), LIMIT)
    assert len(found) == warned
    if warned:
        assert f"reaches ±{widest}°, more than the tilt limit of ±30°" in found[0]


@pytest.mark.parametrize(("judged", "successes", "warned"), [(0.0, 10, True), (1.0, 2, True), (0.6, 10, False)])
def test_a_model_whose_long_rollouts_part_from_the_trials_is_warned_of(
    judged: float, successes: int, warned: bool
) -> None:
    found = doubts(iteration(0, successes, judged_success=judged), LIMIT)
    assert len(found) == warned
    if warned:
        assert f"{100 * judged:.0f} % of the long simulated rollouts succeed" in found[0]


def test_the_table_has_a_line_per_iteration_marks_the_best_and_tells_a_repeated_policy() -> None:
    lines = summary_table(
        dataclasses.replace(SOLVED_LATER, iterations=(*SOLVED_LATER.iterations, again()))
    ).splitlines()
    body = lines[2:6]
    assert [line.split()[:2] for line in body if "*" in line] == [["*", "2"]]
    assert "that of 2" in body[3]
    assert not any("that of" in line for line in body[:3])
    assert "50.0 s" in body[0]
    assert " 0.90 " in body[0] and "±2°, ±3°" in body[0]
    assert "(sha256 000000000000)" in lines[-1]
    assert "iteration_2/policy.pt" in lines[-1]


SCORED = {"log_density": 1.5, "crps": 0.0123, "crps_of_trials": 0.01, "crps_ratio": 1.23}


def test_the_table_has_expected_successes_beside_real_ones_scores_and_why_a_policy_was_driven() -> None:
    first = iteration(0, 3, **SCORED, success_probability=0.83, reason=Reason.FIRST)
    kept = iteration(1, 4, crps=0.5, same_policy_as=0, search=Search.KEPT, reason=Reason.KEPT)
    above, header, line, other = summary_table(summary(first, kept)).splitlines()[:4]
    for upper, lower in (
        ("cost", "predicted"),
        ("driven in", "trials"),
        ("CRPS", "/ of trials"),
    ):  # one above the other
        assert above.index(upper) + len(upper) == header.index(lower) + len(lower)
    assert above.index("succeeds") + len("succeeds") == header.rindex("predicted") + len("predicted")
    assert "new, first" in line and "0.83  3 of 10" in line and "0.012 / 0.01" in line
    assert "that of 0, kept" in other and "-  4 of 10" in other and "0.5 / -" in other


@pytest.mark.parametrize(("ratio", "warned"), [(None, False), (0.9, False), (1.9, False), (2.1, True)])
def test_bands_that_score_much_worse_than_the_trials_own_spread_are_warned_of(
    ratio: float | None, warned: bool
) -> None:
    found = doubts(iteration(0, 10, crps_ratio=ratio), LIMIT)
    assert len(found) == warned
    if warned:
        assert "2.1 times the CRPS of the trials' own spread" in found[0]


def again() -> Iteration:
    return iteration(3, 10, same_policy_as=2, search=Search.NOT_MADE)


def test_the_last_model_is_doubted_in_print() -> None:
    wild = dataclasses.replace(again(), tilt_band_widest=radians(100), coverage95=1.0)
    about = dataclasses.replace(SOLVED_LATER, iterations=(*SOLVED_LATER.iterations, wild))
    assert [line for line in summary_table(about).splitlines() if line.startswith("Warning: ")]
    assert "Warning" not in summary_table(SOLVED_LATER)


def test_the_table_shows_a_dash_for_what_was_not_measured() -> None:
    gone = dict.fromkeys(("real_cost", "coverage95", "drift_m", "tilt_band_median", "tilt_band_widest"))
    line = summary_table(summary(iteration(0, 0, trials=0, **gone))).splitlines()[2]
    assert line.split().count("-") == 6


# Parts of a success

PARTS = {"upright": 10, "settled": 9, "in_place": 3, "quiet": None}
SHOWN = {
    **PARTS,
    "place_by": PlaceBy.POSE,
    "farthest_median_m": 0.5,
    "farthest_worst_m": 4.25,
    "command_change": 0.035,
    "oscillation": radians(6),
}


def test_a_robot_that_stays_up_and_not_where_it_was_put_is_called_that_with_each_part() -> None:
    about = summary(iteration(0, 0, **{**SHOWN, "in_place": 0}))
    assert headline(about) == (
        "The robot stays upright, but not as is asked: no policy succeeded in any of 10 trials. "
        "Of the 10 trials of policy 0, 10 are upright, 9 are settled, 0 are in place."
    )
    fallen = summary(iteration(0, 0, upright=9, settled=0, in_place=0, quiet=2))
    assert headline(fallen).startswith("The robot is not balanced: no policy succeeded in any of 10 trials. Of the 10")


@pytest.mark.parametrize(("by", "words"), [(PlaceBy.POSE, "its true pose"), (PlaceBy.ODOMETRY, "odometry")])
def test_a_headline_says_how_far_the_robot_went_and_what_told_it(by: PlaceBy, words: str) -> None:
    every = {"upright": 10, "settled": 10, "in_place": 10, "farthest_median_m": 0.042, "farthest_worst_m": 0.118}
    assert headline(summary(iteration(0, 10, place_by=by, **every))).endswith(
        f"Late in a trial it was at most 0.04 m from where it was put (median; 0.12 m in the worst), by {words}."
    )


def test_the_table_of_trials_has_each_part_and_says_what_was_not_asked() -> None:
    about = summary(iteration(0, 3, **SHOWN), iteration(1, 0))
    text = summary_table(about)
    assert re.search(r"from where it was put: median, worst  +place by  +command change  +tilt, peak to peak", text)
    (line,) = (line for line in text.splitlines() if "not asked" in line)
    assert line.split() == [
        "*",
        "0",
        "10",
        "10",
        "9",
        "3",
        "not",
        "asked",
        "0.50",
        "m,",
        "4.25",
        "m",
        "pose",
        "0.035",
        "6°",
    ]
    assert "not asked" not in summary_table(summary(iteration(0, 3)))


def test_parts_of_all_trials_of_a_policy_count() -> None:
    again = iteration(1, 2, same_policy_as=0, search=Search.KEPT, **{**PARTS, "in_place": 4})
    about = summary(iteration(0, 3, **PARTS), again)
    assert about.parts(0) == {"upright": 20, "settled": 18, "in place": 7}
    assert summary(iteration(0, 3)).parts(0) == {}
    stays = dataclasses.replace(again, trials_of=0)
    assert summary(iteration(0, 3, **PARTS), stays).parts(0) == {"upright": 10, "settled": 9, "in place": 3}
    table = summary_table(summary(iteration(0, 3, trial_seconds=40.0), dataclasses.replace(stays, trial_seconds=0.0)))
    assert ("those of 0" in table, "and for 40.0 s in trials" in table) == (True, True)


def test_the_worst_distance_is_that_of_all_trials_that_are_counted():
    parts = {"upright": 10, "settled": 10, "in_place": 10, "quiet": 10, "place_by": PlaceBy.POSE}
    first = iteration(0, 10, farthest_median_m=0.03, farthest_worst_m=0.04, **parts)
    again = iteration(1, 10, same_policy_as=0, farthest_median_m=0.05, farthest_worst_m=0.06, **parts)
    assert "at most 0.04 m from where it was put (median; 0.06 m in the worst)" in headline(summary(first, again))


@pytest.mark.parametrize("part", ["upright", "settled", "in_place", "quiet"])
@pytest.mark.parametrize("count", [2, 11, -1])
def test_fewer_trials_of_a_part_than_successes_or_more_than_trials_are_refused(part: str, count: int) -> None:
    with pytest.raises(DataError, match=f"in {count} of 10 trials, and 3 succeeded"):
        iteration(0, 3, **{part: count})


@pytest.mark.parametrize("period", [0.02, 0.015])
def test_the_rule_is_a_sentence_with_its_times_in_seconds(period: float) -> None:
    rule = SuccessCriterion.in_seconds(
        tilt_limit=radians(30),
        settled_tilt_limit=radians(10),
        duration=9.0,
        settle_time=3.0,
        place_time=6.0,
        place_radii=2.0,
        command_change=0.1,
        control_period=period,
        wheel_radius=0.15,
        torque_limit=20.0,
    )
    assert rule_in_words(rule, period) == (
        "A trial succeeds when the tilt stays within 30° for 9 s, under 10° from 3 s on, the robot is within 0.3 m of "
        "where it was put from 6 s on, and the command changes by less than 0.1 of the torque limit from step to step "
        "from 3 s on (root mean square)."
    )
    upright = SuccessCriterion(radians(30), radians(30), 100, 100)
    assert rule_in_words(upright, 0.02) == "A trial succeeds when the tilt stays within 30° for 2 s."
