"""A log whose rate changes is to be cut there: no single rate is right of it."""

import numpy as np
import pytest
from stamped_logs import motion, sampled

from twbal.io.importers.rate_changes import rate_changes

CUT = "the rate changes at line {} from {:g} to {:g} s: cut the file there"


def of_periods(*parts):
    """Steps of parts with a period and a number of rows each."""
    return np.concatenate([np.full(count, period) for period, count in parts])


@pytest.mark.parametrize(("first", "second"), [(0.01, 0.02), (0.02, 0.01), (0.01, 0.012), (0.004, 0.05)])
@pytest.mark.parametrize("jitter", [0.0, 0.05])
def test_a_change_of_the_rate_is_told_with_its_line_and_no_rate_is_advised(first, second, jitter):
    steps = of_periods((first, 1000), (second, 800))
    times = np.concatenate([[0.0], np.cumsum(steps)])
    stamps = times + jitter * first * np.random.default_rng(1).standard_normal(len(times))
    doubts = sampled(stamps, motion(times)).doubts
    if jitter == 0.0:
        assert CUT.format(1002, first, second) in doubts
    (said,) = [doubt for doubt in doubts if "the rate changes" in doubt]
    assert abs(int(said.split("line ")[1].split()[0]) - 1002) <= 5
    assert not any("import.rate" in doubt for doubt in doubts)


def test_a_rate_that_changes_back_is_told_twice():
    steps = of_periods((0.01, 1000), (0.02, 500), (0.01, 1000))
    found = [(each.row, round(each.before, 6), round(each.after, 6)) for each in rate_changes(steps, 50)]
    assert found == [(1000, 0.01, 0.02), (1500, 0.02, 0.01)]


def test_a_change_is_told_of_packets_too():
    times = np.concatenate([[0.0], np.cumsum(of_periods((0.01, 999), (0.02, 1000)))])
    stamps = np.repeat(times[9::10], 10)
    (doubt,) = sampled(stamps, motion(times)).doubts
    assert doubt.startswith("the rate changes at line 10") and "from 0.01 to 0.02 s" in doubt


def test_time_that_often_runs_backwards_is_no_reason_to_advise_one_rate_of_two():
    times = np.concatenate([[0.0], np.cumsum(of_periods((0.01, 600), (0.03, 600)))])
    stamps = times + 0.006 * np.random.default_rng(2).standard_normal(len(times))
    with pytest.raises(
        Exception, match=r"time runs backwards \d+ times.*\. The rate changes at line (59|60)\d"
    ) as caught:
        sampled(stamps, motion(times))
    assert "import.rate" not in str(caught.value)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", ["jitter", "late", "lost", "wanders", "walks", "coarse", "pauses"])
def test_one_rate_is_no_change(kind, seed):
    rng, count = np.random.default_rng(seed), 3000
    times = 0.01 * np.arange(count)
    stamps = {
        "jitter": lambda: times + 0.005 * rng.standard_normal(count),
        "late": lambda: times + rng.exponential(0.006, count),
        "lost": lambda: times[rng.random(count) > np.where(times < 15.0, 0.0, 0.3)],
        "wanders": lambda: np.cumsum(0.01 * (1.0 + 0.04 * np.sin(times))),
        "walks": lambda: np.cumsum(0.01 * (1.0 + 0.3 * rng.standard_normal(count)).clip(0.1)),
        "coarse": lambda: np.floor(times * rng.uniform(1.0, 1.9) / 0.01) * 0.01,
        "pauses": lambda: times + 30.0 * (np.arange(count) // 400),
    }[kind]()
    assert rate_changes(np.diff(stamps), 50) == []


def test_a_pace_that_changes_again_and_again_wanders_and_is_worked_out_soon():
    count = 100_000
    steps = 0.01 * (1.0 + 0.2 * np.sin(np.arange(count) / 100.0))
    assert rate_changes(steps, 50) == []
