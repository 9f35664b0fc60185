"""Stamps of packets are put back to when an even loop took the rows; those of an uneven loop are left alone."""

import numpy as np
import pytest
from foreign_logs import text

from twbal.io.importers.all_columns import all_columns
from twbal.io.importers.bunched_stamps import bunches_of
from twbal.io.importers.measured_columns import seconds_of

PERIOD, COUNT = 0.008, 3000
TIMES = PERIOD * np.arange(COUNT)
ANGLE = np.sin(3.0 * TIMES)
UNEVEN = np.cumsum(np.tile([0.004, 0.036], COUNT // 2))


def packets(rows, late, within, seed, lost=()):
    """Stamps of packets of about so many rows, and which rows arrived; packets come late by an exponential law [s]."""
    rng = np.random.default_rng(seed)
    stamps, kept, begin, before, number = np.empty(COUNT), np.ones(COUNT, bool), 0, 0.0, 0
    while begin < COUNT:
        end = min(begin + rows + int(rng.integers(-1, 2)), COUNT)
        arrival = max(TIMES[end - 1] + rng.exponential(late), before + 1e-4)
        stamps[begin:end] = arrival + within * np.arange(end - begin)
        kept[begin:end] = number not in lost
        begin, before, number = end, stamps[end - 1], number + 1
    return np.round(stamps + 50.0, 4), kept


def found_in(stamps, angle=ANGLE):
    return bunches_of(stamps, {"wheel_angle": angle}, np.column_stack([stamps, angle]))


@pytest.mark.parametrize("within", [0.0, 2e-4])
@pytest.mark.parametrize("late", [0.0, 0.003, 0.008])
@pytest.mark.parametrize("rows", [3, 6, 10])
def test_rows_of_packets_are_where_the_loop_took_them(rows, late, within):
    found = found_in(packets(rows, late, within, seed=rows)[0])
    assert found.numbers.tolist() == list(range(COUNT))
    assert abs(found.period - PERIOD) < max(found.doubt, 2e-4 * PERIOD)
    assert found.rows == pytest.approx(rows, rel=0.1)


def test_a_lost_packet_leaves_a_gap_of_its_rows():
    stamps, kept = packets(6, 0.003, 1e-4, seed=2, lost=(100, 300))
    found = found_in(stamps[kept], ANGLE[kept])
    assert found.numbers.tolist() == np.flatnonzero(kept).tolist()


def test_each_part_of_a_log_whose_clock_is_set_back_begins_at_its_stamp():
    stamps, _ = packets(5, 0.002, 1e-4, seed=3)
    both, angles = np.concatenate([stamps, stamps - 10.0]), np.tile(ANGLE, 2)
    times = found_in(both, angles).times(both, PERIOD)
    assert np.diff(times[:COUNT]) == pytest.approx(PERIOD) and np.diff(times[COUNT:]) == pytest.approx(PERIOD)
    assert times[COUNT] == both[COUNT]


def test_parts_of_fewer_bunches_than_a_first_period_is_taken_over_are_numbered():
    rng = np.random.default_rng(6)
    arrivals = [TIMES[9:400:10] + rng.exponential(0.002, 40) for _ in range(7)]
    found = found_in(np.concatenate(arrivals).repeat(10), np.tile(ANGLE[:400], 7))
    assert found.parts.tolist() == list(range(400, 2800, 400))
    assert found.numbers.tolist() == list(range(400)) * 7
    assert found.period == pytest.approx(PERIOD, rel=1e-3)


def test_stamps_of_a_coarse_clock_are_bunches():
    found = found_in(np.floor(TIMES / 0.1) * 0.1)
    assert found.numbers.tolist() == list(range(COUNT)) and found.period == pytest.approx(PERIOD, rel=1e-3)


@pytest.mark.parametrize("jitter", [0.0, 0.05, 0.3])
def test_even_stamps_that_jitter_are_none(jitter):
    assert found_in(TIMES + jitter * PERIOD * np.random.default_rng(1).uniform(-1.0, 1.0, COUNT)) is None


def test_a_loop_that_is_as_uneven_as_its_stamps_is_none():
    stamps = packets(5, 0.002, 1e-4, seed=4)[0]
    assert found_in(stamps) is not None
    assert found_in(stamps, np.sin(3.0 * stamps)) is None


@pytest.mark.parametrize("noise", [0.004, 0.0])
def test_a_clean_tilt_tells_an_uneven_loop_where_noisy_or_resting_wheels_do_not(noise):
    wheel = noise * np.random.default_rng(7).standard_normal(COUNT)
    of_even_loop, of_uneven_loop = (0.05 * np.sin(3.0 * times) for times in (0.02 * np.arange(COUNT), UNEVEN))
    signals = {"wheel_angle": wheel, "tilt": of_even_loop}
    assert bunches_of(UNEVEN, signals, np.column_stack([UNEVEN, wheel, of_even_loop])) is not None
    signals["tilt"] = of_uneven_loop
    assert bunches_of(UNEVEN, signals, np.column_stack([UNEVEN, wheel, of_uneven_loop])) is None


@pytest.mark.parametrize("moving", ["wheel_angle", "tilt"])
def test_a_log_that_is_seen_for_the_first_time_is_evened_unless_its_loop_is_uneven(moving, tmp_path):
    path = tmp_path / "log.csv"
    for times in (0.02 * np.arange(COUNT), UNEVEN):
        path.write_text(text(np.column_stack([UNEVEN, 0.3 * np.sin(3.0 * times)]), names=("time", moving)))
        steps = np.diff(seconds_of(all_columns(path)))
        assert steps == pytest.approx(np.diff(UNEVEN) if times is UNEVEN else 0.02, rel=1e-3)


def test_rows_that_are_written_twice_and_long_pauses_are_none():
    twice, angles = np.repeat(TIMES, 2), np.repeat(ANGLE, 2)
    assert found_in(twice, angles) is None
    assert found_in(TIMES + 100.0 * (np.arange(COUNT) // 1000)) is None
