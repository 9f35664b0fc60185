"""Stamps of a clock whose ticks are about a period: the loop's rate comes out, and no row is invented or left out."""

import numpy as np
import pytest
from stamped_logs import all_rows, measured_rows, motion, resting, sampled

from twbal.io.importers.coarse_stamps import are_even, coarse_of

SECONDS = 20.0
COARSE = [(70, 0.01), (80, 0.01), (66.67, 0.01), (60, 0.01), (90, 0.01), (99, 0.01), (120, 0.01), (143, 0.01)]
COARSE += [(50, 0.015625), (440, 0.001), (450, 0.001), (600, 0.001), (700, 0.001)]


def instants(rate, seconds=SECONDS):
    return np.arange(round(rate * seconds)) / rate


def ticks(times, tick, phase=0.37):
    """Stamps of a clock that shows whole ticks."""
    return np.round(np.floor(times / tick + phase) * tick, 9)


@pytest.mark.parametrize(("rate", "tick"), COARSE)
def test_the_rate_of_a_loop_is_known_by_stamps_that_are_coarse(rate, tick):
    times = instants(rate)
    found = sampled(ticks(times, tick), motion(times))
    assert found.period.of(1) == pytest.approx(1 / rate, rel=2e-4)
    assert all_rows(found) == [len(times)]
    assert found.doubts == []
    assert not any("missing" in note or "left out" in note for note in found.notes)
    assert found.parts[0]["tilt"] == pytest.approx(motion(times)["tilt"])


@pytest.mark.parametrize("digits", [3, 6])
def test_ticks_of_a_64th_of_a_second_may_be_written_in_milliseconds(digits):
    times = instants(50)
    found = sampled(np.round(ticks(times, 0.015625), digits), motion(times))
    assert found.period.of(1) == pytest.approx(0.02, rel=2e-4) and all_rows(found) == [len(times)]
    assert np.diff(found.parts[0]["time"]) == pytest.approx(0.02, rel=2e-4)
    assert any("ticks of about 0.016 s" in note or "ticks of about 0.0156 s" in note for note in found.notes)


@pytest.mark.parametrize("origin", [0.0, 1.7e9])
@pytest.mark.parametrize(("pause", "counts"), [(30.0, [700, 700]), (-10.0, [700, 700])])
def test_recordings_between_gaps_have_a_clock_each(pause, counts, origin):
    times = instants(70)
    stamps = ticks(times, 0.01) + pause * (np.arange(len(times)) >= 700) + origin
    found = sampled(stamps, motion(times))
    assert found.period.of(1) == pytest.approx(1 / 70, rel=2e-4)
    assert all_rows(found) == counts


@pytest.mark.parametrize(("rate", "tick"), [(70, 0.01), (80, 0.01), (700, 0.001)])
@pytest.mark.parametrize("share", [0.01, 0.03, 0.1])
def test_rows_that_were_lost_besides_are_told_from_long_steps(rate, tick, share):
    times = instants(rate)
    kept = np.random.default_rng(4).random(len(times)) >= share
    kept[[0, -1]] = True
    found = sampled(ticks(times, tick)[kept], motion(times[kept]), fill=10)
    assert found.period.of(1) == pytest.approx(1 / rate, rel=2e-4)
    assert all_rows(found) == [len(times)]
    assert found.doubts == []
    if share < 0.05:
        assert measured_rows(found) == [kept.sum()]


def test_lost_rows_that_ticks_of_more_than_a_period_do_not_tell_are_doubted():
    times = instants(120)
    kept = np.random.default_rng(4).random(len(times)) >= 0.03
    (doubt,) = sampled(ticks(times, 0.01)[kept], motion(times[kept])).doubts
    assert "rows were lost that time stamps with ticks of about 0.01 s do not tell" in doubt


@pytest.mark.parametrize("pattern", ["at random", "each ninth"])
@pytest.mark.parametrize("rate", [50, 100, 200])
def test_rows_that_were_lost_of_an_even_clock_are_no_coarse_stamps(rate, pattern):
    times = instants(rate)
    kept = (
        np.arange(len(times)) % 9 != 5 if pattern == "each ninth" else np.random.default_rng(5).random(len(times)) > 0.1
    )
    kept[[0, -1]] = True
    found = sampled(np.round(times[kept], 3), motion(times[kept]), fill=10)
    assert found.period.of(1) == pytest.approx(1 / rate, rel=2e-4)
    assert sum(all_rows(found)) == len(times)
    assert found.doubts == []
    assert any("missing samples are interpolated, as they are many" in note for note in found.notes)


def test_a_loop_that_is_as_uneven_as_its_ticks_is_not_evened():
    """Steps of one tick and of two, as of a loop that sleeps by a coarse timer."""
    steps = np.random.default_rng(6).choice([0.01, 0.02], 1500, p=[0.6, 0.4])
    times = np.concatenate([[0.0], np.cumsum(steps)])
    assert are_even(steps, motion(times), 0.025) is False
    assert coarse_of(times, motion(times)) is None


@pytest.mark.parametrize("seed", range(5))
def test_a_robot_at_rest_tells_nothing_and_many_filled_rows_are_doubted(seed):
    times = instants(70)
    stamps = ticks(times, 0.01)
    assert are_even(np.diff(stamps), resting(times, seed), 0.025) is None
    (doubt,) = sampled(stamps, resting(times, seed)).doubts
    assert "30% of the samples are missing by the time stamps, and were interpolated" in doubt
    assert "import.rate=70" in doubt


def test_rows_that_the_import_left_out_itself_are_no_doubt():
    times = instants(100)
    kept = np.flatnonzero(np.random.default_rng(7).random(len(times)) > 0.1)
    assert sampled(times[kept], resting(times[kept]), rows=kept).doubts == []
    assert len(sampled(times[kept], resting(times[kept])).doubts) == 1


def test_rows_of_coarse_stamps_that_are_written_twice_count_once():
    times = instants(70)
    signals = {name: np.repeat(values, 2) for name, values in motion(times).items()}
    found = sampled(np.repeat(ticks(times, 0.01), 2), signals)
    assert found.period.of(1) == pytest.approx(1 / 70, rel=2e-4) and all_rows(found) == [len(times)]


@pytest.mark.parametrize("rate", [300, 440])
def test_steps_of_two_and_three_ticks_need_no_angle(rate):
    times = instants(rate)
    found = sampled(np.round(times, 3), resting(times))
    assert found.period.of(1) == pytest.approx(1 / rate, rel=1e-3)
    assert all_rows(found) == [len(times)] and found.doubts == []


@pytest.mark.parametrize("jitter", [0.0, 0.02, 0.1])
def test_stamps_of_a_fine_clock_are_not_coarse(jitter):
    times = instants(100)
    stamps = times + jitter * 0.01 * np.random.default_rng(8).standard_normal(len(times))
    assert coarse_of(stamps, motion(times)) is None
