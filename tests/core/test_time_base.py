"""Motions are sums of sines, of which each value at each instant is known."""

import numpy as np
import pytest

from twbal.core.time_base import evened, is_uneven, pace_of, places_of

PERIOD = 0.01
TIMES = PERIOD * np.arange(801)


def motion(times):
    """Tilt, tilt rate and wheel angle."""
    tilt = 0.1 * np.sin(7.0 * times) + 0.03 * np.cos(23.0 * times)
    rate = 0.7 * np.cos(7.0 * times) - 0.69 * np.sin(23.0 * times)
    return np.column_stack([tilt, rate, 2.0 * np.sin(3.0 * times)])


def jittered(share, seed=1):
    late = share * PERIOD * np.random.default_rng(seed).standard_normal(len(TIMES))
    late[0] = 0.0
    return TIMES + np.clip(late, -0.4 * PERIOD, 0.4 * PERIOD)


def noisy(values, seed=2):
    return values + [0.0005, 0.01, 0.002] * np.random.default_rng(seed).standard_normal(values.shape)


def by_itself(times, values, commands, period, angles, rates):
    """One recording that alone tells whether its loop is uneven."""
    uneven = is_uneven([pace_of(times, values[:, angles], period)])
    return evened(times, values, commands, period, angles, rates, uneven)


def test_an_even_loop_is_left_as_it_is():
    values, commands = noisy(motion(TIMES)), TIMES[:-1]
    even = by_itself(TIMES, values, commands, PERIOD, [0, 2], [])
    np.testing.assert_array_equal(even.values, values)
    np.testing.assert_array_equal(even.commands, commands)
    assert even.measured.all()


@pytest.mark.parametrize("clock", [1.0, 1.003])
def test_angles_of_an_uneven_loop_are_those_of_an_even_one(clock):
    times = jittered(0.1)
    even = by_itself(clock * times, motion(times), TIMES[:-1], PERIOD, [0, 2], [])
    inside = slice(5, -5)
    before = motion(times)[inside] - motion(TIMES)[inside]
    after = even.values[inside] - motion(TIMES)[inside]
    sizes = [np.sqrt(np.mean(off[:, [0, 2]] ** 2, axis=0)) for off in (before, after)]
    assert (sizes[1] < 0.35 * sizes[0]).all()
    np.testing.assert_array_equal(even.values[:, 1], motion(times)[:, 1])


def test_noise_does_not_hide_that_a_loop_is_uneven():
    times = jittered(0.1)
    values = noisy(motion(times))
    assert not np.array_equal(by_itself(times, values, TIMES[:-1], PERIOD, [0, 2], []).values, values)


@pytest.mark.parametrize("seed", range(20))
def test_stamps_that_jitter_alone_move_nothing(seed):
    values = noisy(motion(TIMES), seed)
    even = by_itself(jittered(0.1, 100 + seed), values, TIMES[:-1], PERIOD, [0, 2], [])
    np.testing.assert_array_equal(even.values, values)


@pytest.mark.parametrize("wander", [0.0, 2.0])
def test_a_steady_clock_is_known_from_all_stamps_and_one_that_wanders_from_those_near(wander):
    """Stamps of an uneven loop by a clock that wanders by `wander` periods, either way, over some seconds."""
    times = jittered(0.1)
    drift = wander * PERIOD * np.sin(0.8 * times)
    even = by_itself(times + drift, motion(times), TIMES[:-1], PERIOD, [0, 2], [])
    inside = slice(30, -30)
    before, after = (np.sqrt(np.mean((each - motion(TIMES))[inside, 2] ** 2)) for each in (motion(times), even.values))
    assert after < (0.25 if wander else 0.1) * before


@pytest.mark.parametrize("is_loop", [True, False])
def test_recordings_tell_together_what_one_alone_cannot(is_loop):
    """A jitter of 0.4 % of a period: of some recordings alone the opposite would be believed."""
    paces = []
    for seed in range(60):
        times = jittered(0.004, 300 + seed)
        paces.append(pace_of(times, noisy(motion(times if is_loop else TIMES), 400 + seed)[:, [0, 2]], PERIOD))
    assert 3 < sum(is_uneven([pace]) != is_loop for pace in paces) < 30
    assert all(is_uneven(paces[first::3]) == is_loop for first in range(3))


@pytest.mark.parametrize("share", [1e-5, 1e-4, 1e-3])
def test_stamps_that_jitter_by_next_to_nothing_are_those_of_an_even_loop(share):
    for seed in range(40):
        pace = pace_of(jittered(share, 500 + seed), noisy(motion(TIMES), 600 + seed)[:, [0, 2]], PERIOD)
        assert not is_uneven([pace])


def test_stamps_of_an_even_loop_since_1970_are_even():
    """Their last digit is 2.4e-7 s."""
    since = 1.76e9 + 1.0 / 3.0
    assert pace_of(since + TIMES, noisy(motion(TIMES))[:, [0, 2]], PERIOD) == (0.0, 0.0)


def test_even_stamps_tell_nothing():
    assert pace_of(TIMES, noisy(motion(TIMES))[:, [0, 2]], PERIOD) == (0.0, 0.0)
    assert not is_uneven([]) and not is_uneven([pace_of(TIMES[:3], motion(TIMES[:3]), PERIOD)])


def test_stamps_of_packets_that_arrive_in_bunches_lose_no_row():
    stamps = 4 * PERIOD * np.ceil(np.arange(801) / 4) + 1e-4 * PERIOD * np.arange(801)
    values = noisy(motion(TIMES))
    even = by_itself(stamps, values, TIMES[:-1], PERIOD, [0, 2], [])
    np.testing.assert_array_equal(even.values, values)


def test_rows_that_were_lost_are_filled_and_marked():
    lost = np.zeros(len(TIMES), bool)
    lost[[40, 200, 201, 600]] = True
    even = by_itself(TIMES[~lost], motion(TIMES)[~lost], TIMES[:-1][~lost[:-1]], PERIOD, [0, 2], [])
    np.testing.assert_array_equal(even.measured, ~lost)
    np.testing.assert_allclose(even.values[~lost], motion(TIMES)[~lost])
    assert np.abs(even.values[lost] - motion(TIMES)[lost]).max() < 0.1
    assert len(even.commands) == len(even.values) - 1
    np.testing.assert_allclose(even.commands[~lost[:-1]], TIMES[:-1][~lost[:-1]])


def test_places_increase_whatever_the_stamps():
    rng = np.random.default_rng(3)
    places = places_of(np.cumsum(rng.exponential(PERIOD, 500)), PERIOD)
    assert (np.diff(places.numbers) >= 1).all()
    assert np.abs(places.late[1:]).max() < 50 * PERIOD


def pushed(commands):
    """A mass under commands of an uneven loop: its instants, and angle and rate there and at even instants."""
    times = jittered(0.1, 7)
    lengths = np.diff(times)
    rates = np.concatenate([[0.0], np.cumsum(commands * lengths)])
    angles = np.concatenate([[0.0], np.cumsum(rates[:-1] * lengths + 0.5 * commands * lengths**2)])
    begun = np.clip(np.searchsorted(times, TIMES, side="right") - 1, 0, len(commands) - 1)
    since = TIMES - times[begun]
    rate = rates[begun] + commands[begun] * since
    angle = angles[begun] + rates[begun] * since + 0.5 * commands[begun] * since**2
    return times, np.column_stack([angles, rates]), np.column_stack([angle, rate])


COMMANDS = np.random.default_rng(8).choice([-1.0, 0.0, 1.0], len(TIMES) - 1)
INSIDE = slice(30, -30)


def test_rates_and_commands_of_an_uneven_loop_are_those_of_an_even_one():
    times, seen, true = pushed(COMMANDS)
    even = by_itself(times, seen, COMMANDS, PERIOD, [0], [1])
    off, left = (np.sqrt(np.mean((values - true)[INSIDE] ** 2, axis=0)) for values in (seen, even.values))
    assert (left < [0.12, 0.2] * off).all()
    missed, still = (np.std((np.diff(true[:, 1]) - PERIOD * given)[INSIDE]) for given in (COMMANDS, even.commands))
    assert still < 0.3 * missed


def test_a_command_before_a_lost_row_acts_for_two_periods():
    lost = np.zeros(len(TIMES), bool)
    lost[20:-20:8] = True
    commands = COMMANDS.copy()
    commands[lost[:-1]] = commands[np.flatnonzero(lost) - 1]  # which the robot held
    times, seen, true = pushed(commands)
    kept = np.flatnonzero(~lost)
    even = by_itself(times[kept], seen[kept], commands[kept[:-1]], PERIOD, [0], [1])
    before = np.flatnonzero(lost) - 1
    gained = true[before + 2, 1] - true[before, 1]
    missed, still = (
        np.std(gained - PERIOD * (given[before] + given[before + 1])) for given in (commands, even.commands)
    )
    assert still < 0.35 * missed
