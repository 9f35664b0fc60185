"""Groups of runs: medians with intervals that hold the truth, and pairs that belong together."""

import math
from dataclasses import replace

import numpy as np
import pytest

from twbal.algorithm.comparison import METRICS, Run, estimate, latex, paired, rows, run_values, unmeasured
from twbal.algorithm.iteration import Iteration, PolicyFile, Search
from twbal.algorithm.summary import SimData, Summary


def run(seed, seconds, **more):
    return Run(("paper", str(seed)), {**dict.fromkeys(METRICS, 1.0), "seconds": seconds, **more})


@pytest.mark.parametrize("count", [6, 7, 10, 25])
def test_the_interval_of_a_median_holds_it_at_least_as_often_as_it_says(count):
    rng, held, draws = np.random.default_rng(count), 0, 3000
    for _ in range(draws):
        said = estimate(list(rng.exponential(1.0, count)))
        held += said.low <= math.log(2) <= said.high
    assert 0.94 < held / draws < 0.99


def test_few_runs_have_no_interval():
    assert estimate([8.14, math.nan]).words == "8.14"
    assert estimate([1.0, 2.0, 3.0, 4.0, 5.0]).words == "3"
    assert estimate([1.0, 2.0, 3.0, 4.0, 5.0, math.inf]).words == "3.5 (1 to inf)"


def test_runs_that_never_got_there_count_as_endless_and_missing_ones_do_not_count():
    assert estimate([1.0, 2.0, math.inf]).value == 2.0
    assert estimate([1.0, math.inf, math.inf]).value == math.inf
    assert estimate([1.0, math.nan, 3.0, 3.0]).value == 3.0
    assert estimate([math.nan]) is None


def test_the_median_of_an_even_number_is_the_mean_of_the_two_in_the_middle():
    assert estimate([1.0, 2.0, 4.0, 9.0]).value == 3.0
    assert estimate([1.0, math.inf]).value == math.inf
    rng = np.random.default_rng(3)
    middles = [estimate(list(rng.normal(size=2))).value for _ in range(4000)]
    assert abs(np.mean(middles)) < 4 * np.sqrt(0.5 / 4000)


def test_only_figures_are_infinite_in_latex():
    table = [{"group": "inf", "information": "inf (1 to inf)"}, {"group": "a{b}", "information": "reinforced"}]
    heads, _, figures = latex(table).splitlines()[1:-1]
    assert heads == r"group & inf & a\{b\} \\"
    assert figures == r"information & $\infty$ (1 to $\infty$) & reinforced \\"


def test_the_best_policy_is_measured_by_all_of_its_trials_and_its_newest_band():
    first = Iteration(0, 0, 0, 0.0, 3.0, 8.0, 10, 10, 0.1, 1.0, 2.0, 4.0, 1.0, PolicyFile("p.pt", "0" * 64), "", 100.0)
    again = replace(first, index=1, real_seconds=6.0, successes=8, real_cost=10.0, coverage95=1.0, drift_m=2.0)
    again = replace(again, same_policy_as=0, search=Search.NOT_MADE, tilt_band_widest=1.5)
    values = run_values(Summary("paper", 0, 1.0, SimData(1, 2), (first, again), 0))
    assert (values["success"], values["cost"], values["drift"]) == (0.9, 9.0, 3.0)
    assert (values["coverage"], values["tilt_band"]) == (1.0, 1.5)
    assert (values["seconds"], values["trial_seconds"]) == (0.0, 100.0)
    stays = replace(again, index=2, search=Search.KEPT, trials_of=0, successes=10, real_cost=8.0, coverage95=0.9)
    values = run_values(Summary("paper", 0, 1.0, SimData(1, 2), (first, again, stays), 0))
    assert (values["success"], values["cost"], values["coverage"]) == (0.9, 9.0, 0.9)


def test_pairs_share_robot_and_seed_and_the_sign_test_is_that_of_the_binomial():
    first = [run(k, 10.0) for k in range(8)]
    second = [run(k, 5.0) for k in range(6)] + [run(6, 10.0), run(99, 1.0)]
    found = paired(second, first, "seconds")
    assert (found.better, found.worse) == (6, 0)
    assert found.p == pytest.approx(2 * 0.5**6)
    assert paired(first, second, "seconds").worse == 6
    assert paired([run(0, 1.0), run(0, 2.0)], first, "seconds").better == 0  # which of the two?
    assert paired([run(0, math.nan), run(1, 1.0)], first, "seconds")[:2] == (1, 0)


def test_more_success_is_better_and_more_cost_is_worse():
    low, high = [run(0, 1.0, success=0.2, cost=3.0)], [run(0, 1.0, success=0.9, cost=9.0)]
    assert paired(high, low, "success").better == 1
    assert paired(high, low, "cost").worse == 1


def test_the_table_has_a_row_for_each_group_and_latex_has_no_bare_marks():
    table = rows({"a_b": [run(0, 1.0)], "100 %": [run(0, math.inf)]})
    assert [row["group"] for row in table] == ["a_b", "100 %"]
    text = latex(table)
    assert r"a\_b" in text
    assert r"100 \%" in text
    assert r"$\infty$" in text


def test_the_pairs_are_counted_and_without_any_stands_a_dash():
    first, second = [run(0, 1.0), run(1, 2.0, cost=math.nan)], [run(0, 1.0), run(1, 1.0), run(5, 1.0)]
    assert paired(second, first, "seconds").words == "1, 0, 2, 1"
    assert paired(second, first, "cost").words == "0, 0, 1, 1"
    assert paired([run(7, 1.0)], first, "seconds").words == "-"


def test_metrics_that_do_not_compare_are_a_dash_in_each_group_and_in_pairs():
    groups = {"a": [run(0, 1.0), run(1, 1.0)], "b": [run(0, 2.0), run(1, 2.0)]}
    for row in rows(unmeasured(groups, ["cost"])):
        assert row["real long-term cost, best policy"] == "-"
        assert row.get("real long-term cost, best policy: better, worse, pairs, p", "-") == "-"
        assert row["driven to learn until all trials succeed [s]"] != "-"
    assert groups["a"][0].values["cost"] == 1.0
