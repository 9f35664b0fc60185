"""A single stamp that is damaged costs its row alone; the recording goes on, and no number overflows."""

import numpy as np
import pytest
from stamped_logs import all_rows, measured_rows, motion, sampled

from twbal.io.importers.bunched_stamps import bunches_of
from twbal.io.importers.damaged_stamps import damaged_stamps

COUNT = 2000
TIMES = 0.01 * np.arange(COUNT)


@pytest.mark.parametrize("value", [1e25, -1e25, 1e12, 0.0, 1.7e9])
def test_a_damaged_stamp_costs_its_row_alone(value):
    stamps = TIMES.copy()
    stamps[500] = value
    found = sampled(stamps, motion(TIMES))
    assert found.period.of(1) == 0.01
    assert all_rows(found) == [COUNT] and measured_rows(found) == [COUNT - 1]
    assert found.notes == [
        f"1 row with a time stamp far from those before and after is left out, the first in line 502 ({value:.6g} s)",
        "1 missing sample is left out, as a diagnosis does not count it",
    ]


@pytest.mark.parametrize("at", [0, COUNT - 1])
def test_the_first_and_the_last_stamp_may_be_damaged_too(at):
    stamps = TIMES.copy()
    stamps[at] = 1e25
    found = sampled(stamps, motion(TIMES))
    assert all_rows(found) == [COUNT - 1] and found.period.of(1) == 0.01


def test_a_damaged_stamp_of_a_packet_is_its_packets():
    stamps = np.repeat(TIMES[9::10], 10)
    stamps[503] = 1e25
    found = sampled(stamps, motion(TIMES))
    assert found.period.of(1) == 0.01
    assert all_rows(found) == [COUNT] and measured_rows(found) == [COUNT - 1]


def test_a_damaged_stamp_of_a_coarse_clock_costs_its_row_alone():
    times = np.arange(1400) / 70
    stamps = np.round(times, 2)
    stamps[700] = 1e25
    found = sampled(stamps, motion(times))
    assert found.period.of(1) == pytest.approx(1 / 70, rel=2e-4)
    assert all_rows(found) == [1400] and measured_rows(found) == [1399]


def test_a_gap_that_no_count_of_samples_tells_is_told_as_time():
    stamps = TIMES.copy()
    stamps[500:503] = 1e25 * np.array([1.0, 2.0, 3.0])
    found = sampled(stamps, motion(TIMES))
    assert all_rows(found) == [500, 1, 1, 1, 1497]
    assert any("1e+25 s are missing before line 502" in note for note in found.notes)


def test_packets_with_damaged_stamps_are_numbered_without_an_overflow():
    """As the proposal of a mapping asks for them, before anything is mended."""
    stamps = np.repeat(TIMES[9::10], 10)
    stamps[503] = 1e25
    rows = np.column_stack([stamps, *motion(TIMES).values()])
    assert bunches_of(stamps, motion(TIMES), rows).period == pytest.approx(0.01, rel=1e-2)


SWAPPED = np.arange(COUNT)
SWAPPED[[500, 501]] = SWAPPED[[501, 500]]
OTHER = {
    "jitter": TIMES + 0.01 * np.random.default_rng(1).standard_normal(COUNT),
    "restart": np.where(np.arange(COUNT) < 900, TIMES, TIMES - 9.0),
    "pause": TIMES + 60.0 * (np.arange(COUNT) >= 900),
    "a clock that is set": TIMES + 1.7e9 * (np.arange(COUNT) >= 900),
    "swapped rows": TIMES[SWAPPED],
    "many": np.where(np.arange(COUNT) % 20 == 7, 0.0, TIMES),
}


@pytest.mark.parametrize("kind", OTHER)
def test_other_stamps_are_not_damaged(kind):
    assert not damaged_stamps(OTHER[kind]).any()
