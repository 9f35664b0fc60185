"""The first and the last bunch of a recording may be cut, and do not count; what bunches tell badly is doubted."""

import numpy as np
import pytest
from stamped_logs import all_rows, motion, sampled

from twbal.io.importers.bunched_stamps import bunches_of

PERIOD = 0.01


def instants(seconds, begin=0.0):
    return begin + PERIOD * np.arange(round(seconds / PERIOD))


@pytest.mark.parametrize("seconds", [12.0, 19.3, 19.5, 20.0, 20.01, 20.99])
@pytest.mark.parametrize("begin", [0.0, 0.02, 0.4, 0.97])
def test_whole_seconds_tell_the_period_wherever_a_log_begins_and_ends(begin, seconds):
    times = instants(seconds, begin)
    found = sampled(np.floor(times + 1e-9), motion(times))
    assert found.period.of(1) == PERIOD
    assert all_rows(found) == [len(times)] and found.doubts == []
    assert any("(bunches arrive ±0 ms early or late)" in note for note in found.notes)


@pytest.mark.parametrize("pause", [-50.0, 300.0])
def test_bunches_that_are_cut_at_a_restart_or_a_pause_do_not_count(pause):
    """By the pause, the period would be known by a number of lost rows that was worked out with it."""
    times = instants(40.3, 0.35)
    rng = np.random.default_rng(1)
    arrivals = np.floor(times) + 0.002 * rng.random(100)[np.floor(times).astype(int)]
    stamps = arrivals + pause * (np.arange(len(times)) >= 2043)
    found = bunches_of(stamps, motion(times), np.column_stack([stamps, *motion(times).values()]))
    assert found.parts.tolist() == [2043]
    assert found.period == pytest.approx(PERIOD, rel=2e-4)
    assert found.late < 0.002
    assert found.numbers.tolist() == [*range(2043), *range(len(times) - 2043)]


@pytest.mark.parametrize(("late", "is_doubted"), [(0.5, False), (1.0, False), (8.0, True)])
def test_bunches_that_are_late_by_many_periods_are_doubted(late, is_doubted):
    times = instants(40.0)
    rng = np.random.default_rng(2)
    arrivals = np.maximum.accumulate(times[19::20] + late * PERIOD * rng.exponential(size=len(times) // 20))
    found = sampled(np.repeat(arrivals, 20), motion(times))
    assert any("early or late, which is more than 3 periods" in doubt for doubt in found.doubts) == is_doubted
    assert is_doubted or found.doubts == []


def test_a_period_that_few_late_bunches_tell_badly_is_doubted():
    times = instants(8.0)
    arrivals = times[49::50] + 0.05 * np.random.default_rng(3).random(16)
    (doubt,) = sampled(np.repeat(arrivals, 50), motion(times)).doubts
    assert "tell the period of" in doubt and "import.rate=... [Hz]" in doubt
