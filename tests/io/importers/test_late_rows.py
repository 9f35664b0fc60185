"""Rows that are late and then caught up with are none that were lost; a loop whose pace wanders loses none, either."""

import numpy as np
import pytest
from stamped_logs import all_rows, measured_rows, motion, sampled

PERIOD, COUNT = 0.01, 2000
TIMES = PERIOD * np.arange(COUNT)


def late(share, by, seed=1):
    stamps = TIMES + by * (np.random.default_rng(seed).random(COUNT) < share)
    return np.maximum.accumulate(stamps)


@pytest.mark.parametrize("by", [0.004, 0.0055, 0.0065, 0.0099, 0.0149])
def test_rows_that_are_late_are_not_lost(by):
    found = sampled(late(0.03, by), motion(TIMES))
    assert all_rows(found) == [COUNT]
    assert found.period.of(1) == PERIOD
    assert not any("missing" in note for note in found.notes)
    assert found.parts[0]["tilt"] == pytest.approx(motion(TIMES)["tilt"])


def test_rows_that_are_lost_are_told_from_those_that_are_late():
    kept = np.random.default_rng(2).random(COUNT) > 0.02
    kept[[0, -1]] = True
    found = sampled(late(0.03, 0.0065)[kept], motion(TIMES[kept]))
    assert measured_rows(found) == [kept.sum()]
    assert all_rows(found) == [COUNT]


@pytest.mark.parametrize("jitter", [0.1, 0.15, 0.2])
def test_stamps_that_jitter_lose_no_row(jitter):
    stamps = np.maximum.accumulate(TIMES + jitter * PERIOD * np.random.default_rng(3).standard_normal(COUNT))
    assert all_rows(sampled(stamps, motion(TIMES))) == [COUNT]


@pytest.mark.parametrize("share", [0.03, 0.06, 0.1])
def test_a_loop_whose_pace_wanders_loses_no_row(share):
    """Then the clock of an even loop falls behind by more than half a period, and catches up."""
    times = np.cumsum(PERIOD * (1.0 + share * np.sin(2.0 * np.pi * TIMES / 7.0)))
    assert all_rows(sampled(times, motion(times))) == [COUNT]


def test_steps_that_are_nowhere_near_a_typical_one_have_a_period():
    """Half are of 1 ms, half of 4: their median lies between."""
    times = np.cumsum(np.tile([0.001, 0.004], 100))
    assert 0.001 <= sampled(times, motion(times)).period.of(1) <= 0.004
