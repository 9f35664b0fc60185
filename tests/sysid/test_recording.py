from dataclasses import replace

import numpy as np
import pytest

from twbal.core.episode import Episode, Outcome, Provenance
from twbal.core.errors import DataError
from twbal.core.time_base import evened
from twbal.sysid.recording import (
    Usability,
    check_episodes,
    commands_over,
    differenced_rates,
    read_recordings,
    stuck_sensors,
    what_is_not_used,
)
from twbal.sysid.uneven_loop import UnevenLoop, uneven_sum

USABILITY = Usability(min_length=20, min_samples=50, max_yaw_rate=1.5, max_tilt=0.6)


def episode(periods=100, period=0.02, channel=None, value=None, commands=None):
    rng = np.random.default_rng(0)
    seen = 0.1 * rng.standard_normal((periods + 1, 7))
    seen[:, 0] = period * np.arange(periods + 1)
    if channel is not None:
        seen[:, channel] = value
    commands = rng.standard_normal(periods) if commands is None else commands
    return Episode(("tilt",), period, seen, seen[:, 1:2], commands, Outcome.COMPLETED, Provenance("paper", "robot"))


def read(robot, *episodes):
    return read_recordings(episodes, [f"run{i}" for i in range(len(episodes))], robot, USABILITY)


def test_it_takes_the_measured_channels_as_they_are(paper):
    (recording,) = read(paper, episode())
    np.testing.assert_array_equal(recording.measured, episode().observations[:, [1, 2, 4, 5]])
    np.testing.assert_array_equal(recording.commands, episode().commands)
    assert recording.usable.all()


def test_a_sensor_that_was_off_in_one_of_several_recordings_is_told(paper):
    recordings = read(paper, episode(), episode(channel=4, value=0.25))
    (said,) = stuck_sensors(recordings)
    assert said.startswith("WARNING: wheel_angle is 0.25 throughout run1, and changes in others.")
    assert stuck_sensors(recordings[1:]) == []


def test_a_recording_ends_where_the_robot_has_fallen(paper):
    tilt = np.zeros(101) + 0.01 * np.random.default_rng(1).standard_normal(101)
    tilt[60:] = 1.0
    (recording,) = read(paper, episode(channel=1, value=tilt))
    assert len(recording) == 59
    assert len(recording.measured) == 60


def test_instants_of_fast_turning_do_not_count(paper):
    yaw = np.zeros(101)
    yaw[10:15] = 2.0
    (recording,) = read(paper, episode(channel=6, value=yaw))
    assert not recording.usable[10:15].any()
    assert recording.usable.sum() == 96


def test_commands_beyond_the_torque_limit_are_cut_as_the_robot_cuts_them(paper):
    (recording,) = read(paper, episode(commands=np.linspace(-50, 50, 100)))
    assert np.abs(recording.commands).max() == paper.torque_limit


BAD = {
    "at least one": [],
    "Needed are 50 control periods": [episode(periods=30)],
    "Channel wheel_rate is 0.5 throughout": [episode(channel=5, value=0.5)],
    "The command is 1 N·m throughout": [episode(commands=np.ones(100))],
    "control period of 0.01 s, .* set its period by robot.control_period=0.01": [episode(period=0.01)],
    "17% of the samples are missing": [
        episode(channel=0, value=np.cumsum(np.r_[0, np.where(np.arange(100) % 5, 0.02, 0.04)]))
    ],
}


@pytest.mark.parametrize("words", BAD)
def test_data_that_cannot_be_used_are_refused_with_the_reason(paper, words):
    with pytest.raises(DataError, match=words):
        read(paper, *BAD[words])


def driven(gyro=0.01, ticks=1000, differenced=True):
    """A tilt that a complementary filter makes of a gyro, and an encoder with or without a timer for its rate."""
    rng, times = np.random.default_rng(6), 0.02 * np.arange(501)
    tilt, rate = 0.1 * np.sin(4.0 * times), 0.4 * np.cos(4.0 * times) + gyro * rng.standard_normal(501)
    shown = np.zeros(501)
    for k in range(1, 501):
        shown[k] = 0.98 * (shown[k - 1] + 0.02 * rate[k]) + 0.02 * (tilt[k] + 0.05 * np.sin(9.0 * times[k]))
    step = 2.0 * np.pi / ticks
    angle = step * np.floor((3.0 * np.sin(5.0 * times) + 20.0 * times) / step)
    wheel_rate = np.r_[0.0, np.diff(angle)] / 0.02 if differenced else 15.0 * np.cos(5.0 * times) + 20.0
    return np.column_stack([shown, rate, angle, wheel_rate]), times


def test_a_wheel_rate_that_is_a_difference_is_no_measurement():
    assert differenced_rates(*driven()) == {"wheel_rate"}


def test_a_gyro_that_a_filter_adds_up_to_the_tilt_is_one_and_so_is_a_timed_wheel():
    assert differenced_rates(*driven(differenced=False)) == set()


def test_a_tilt_rate_that_is_a_difference_is_no_measurement():
    measured, times = driven(differenced=False)
    measured[1:, 1] = np.diff(measured[:, 0]) / 0.02
    assert differenced_rates(measured, times) == {"tilt_rate"}


def test_an_uneven_loop_with_lost_rows_is_read(paper):
    """Its angles are moved to even instants; a row that was lost is there and does not count."""
    times = 0.02 * np.arange(201) + 0.002 * np.random.default_rng(4).standard_normal(201)
    kept = np.arange(201) != 90
    moving = np.zeros((200, 7))
    moving[:, 0] = times[kept]
    moving[:, 1], moving[:, 4] = 0.1 * np.sin(8.0 * times[kept]), 3.0 * np.sin(5.0 * times[kept])
    moving[:, 2], moving[:, 5] = 0.8 * np.cos(8.0 * times[kept]), 15.0 * np.cos(5.0 * times[kept])
    uneven = Episode(("tilt",), 0.02, moving, moving[:, 1:2], np.ones(199), Outcome.COMPLETED, Provenance("p", "robot"))
    commands = replace(uneven, commands=np.random.default_rng(5).standard_normal(199))
    (recording,) = read(paper, commands)
    assert len(recording.measured) == 201
    assert np.flatnonzero(~recording.usable).tolist() == [90]
    even = 0.02 * np.arange(201)
    off = (recording.measured[:, 0] - 0.1 * np.sin(8.0 * even))[kept]
    assert off.std() < 0.5 * (moving[:, 1] - 0.1 * np.sin(8.0 * even[kept])).std()


def test_commands_of_even_and_uneven_loops_have_as_many_parts(paper):
    times = 0.02 * np.arange(201) + 0.002 * np.random.default_rng(4).standard_normal(201)
    moving = np.zeros((201, 7))
    moving[:, 0], moving[:, 1], moving[:, 2] = times, 0.1 * np.sin(8.0 * times), 0.8 * np.cos(8.0 * times)
    moving[:, 4], moving[:, 5] = 3.0 * np.sin(5.0 * times), 15.0 * np.cos(5.0 * times)
    made = Episode(("tilt",), 0.02, moving, moving[:, 1:2], np.ones(200), Outcome.COMPLETED, Provenance("p", "robot"))
    (uneven,) = read(paper, replace(made, commands=np.random.default_rng(5).standard_normal(200)))
    even = replace(uneven, uneven=None)
    assert uneven.uneven is not None
    mixed = commands_over([even, uneven], 4)
    assert [each.shape for each in mixed] == [(200, 4), (200, 4)]
    np.testing.assert_array_equal(mixed[0], np.repeat(even.commands[:, None], 4, axis=1))
    assert commands_over([even, even], 4)[0].shape == (200, 1)


def test_a_clock_that_runs_backwards_is_refused(paper):
    times = 0.02 * np.arange(101)
    times[50] = 0.1
    with pytest.raises(DataError, match="Time does not run forward"):
        episode(channel=0, value=times)


def test_what_is_not_read_of_an_episode_is_said(paper):
    tilt = np.where(np.arange(101) < 60, 0.0, 1.0)
    whole, falls, lies, short = (
        episode(),
        episode(channel=1, value=tilt),
        episode(channel=1, value=1.0),
        episode(periods=10),
    )
    given, names = [whole, falls, lies, short], ["whole", "falls", "lies", "short"]
    said = what_is_not_used(given, names, names[:2], USABILITY)
    assert said == [
        "the tilt of episode falls is 57.3° at 1.2 s, beyond the limit of 34.4°: only its first 1.2 s of 2 s are used",
        "the tilt of episode lies is 57.3° at 0 s, beyond the limit of 34.4°: it is left out",
        "episode short is left out: it has 10 samples of 20",
    ]


@pytest.mark.parametrize(("fast", "is_read"), [(60, True), (90, False)])
def test_instants_that_do_not_count_are_not_taken_for_enough_and_said(paper, fast, is_read):
    turning = episode(channel=6, value=np.where(np.arange(101) < fast, 6.0, 0.1))
    usability = Usability(min_length=20, min_samples=30, max_yaw_rate=1.5, max_tilt=0.6)
    said = f"turns faster than 1.5 rad/s in {fast / 101:.0%} of its samples, which do not count"
    if is_read:
        read_recordings([turning], ["run"], paper, usability)
        assert said in what_is_not_used([turning], ["run"], ["run"], usability)[0]
    else:
        with pytest.raises(DataError, match=f"found 0 in 0 of 1 episodes.*{said}, and is left out .is its yaw rate"):
            read_recordings([turning], ["run"], paper, usability)


@pytest.mark.parametrize("words", ["Channel wheel_rate", "The command is 1 N", "control period of 0.01 s"])
def test_what_nothing_can_be_learned_from_is_refused_however_long_it_is(paper, words):
    with pytest.raises(DataError, match=words):
        check_episodes(next(given for said, given in BAD.items() if words in said), ["run"], paper)
    check_episodes([episode(periods=4)], ["run"], paper)


def test_a_robot_that_never_stands_is_refused(paper):
    """Such as by a tilt in degrees."""
    lying = episode(channel=1, value=np.linspace(40.0, 60.0, 101))
    with pytest.raises(
        DataError, match=r"stands in none of 1 episodes: its tilt is 2.29e\+03° and more. Is the tilt in"
    ):
        check_episodes([lying], ["run"], paper)
    check_episodes([lying, episode()], ["run", "other"], paper)


def test_commands_in_another_unit_are_doubted(paper):
    usual, thousandths = episode(), episode(commands=1000.0 * np.sin(np.arange(100)))
    names = ["usual", "thousandths"]
    (said,) = what_is_not_used([usual, thousandths], names, names, USABILITY, paper)
    assert "97% of the commands of episode thousandths are beyond the torque limit of 20 N·m" in said


def test_recordings_of_a_robot_that_lies_are_refused_with_when_and_why(paper):
    with pytest.raises(DataError, match=r"The tilt of episode run0 is 57\.3° at 0 s, beyond the limit of 34\.4°"):
        read_recordings([episode(channel=1, value=1.0)], ["run0"], paper, Usability(0, 0, 1.5, 0.6))


def tilt_filter(times, rates, directions, time_constant, tilt):
    """A complementary filter as firmware has it: rectangles of the gyro, and the direction that its accelerometer sees.

    Args:
        times: (T + 1,) of its loop [s].
        rates: (T + 1,) readings of the gyro [rad/s].
        directions: (T,) mean over each step [rad].
        time_constant: [s].
        tilt: that it begins with [rad].
    """
    tilts = [tilt]
    for elapsed, rate, direction in zip(np.diff(times), rates[1:], directions, strict=True):
        share = elapsed / (time_constant + elapsed)
        tilts.append((1.0 - share) * (tilts[-1] + elapsed * rate) + share * direction)
    return np.array(tilts)


@pytest.mark.parametrize("shaking", [2.0, 8.0])
def test_a_filtered_tilt_of_an_uneven_loop_is_what_a_sum_over_even_periods_would_have_shown(shaking):
    """A body that swings, and is shaken by torques that change with each command [rad/s²].

    What a sum over even periods shows at an uneven instant is that of an even loop which is shifted to this instant.
    """
    period, time_constant, rng = 0.01, 0.5, np.random.default_rng(3)
    instants = period * np.arange(1201)
    late = 0.1 * period * np.clip(rng.standard_normal(1201), -3.0, 3.0)
    late[0] = 0.0
    times = instants + late
    fine = np.linspace(-period, times[-1] + period, 400_001)
    pushes = shaking * np.diff(rng.uniform(-1.0, 1.0, 1202))
    acting = pushes[np.clip(np.searchsorted(times, fine, side="right") - 1, 0, 1200)]
    step = fine[1] - fine[0]
    rate = 0.7 * np.cos(7.0 * fine) + np.cumsum(acting) * step
    tilt, along = np.cumsum(rate) * step, 0.02 * rate  # the IMU sits 0.2 m above the axle: v = 0.02 g θ̇

    def seen(loop):
        rates, speeds, tilts = (np.interp(loop, fine, values) for values in (rate, along, tilt))
        directions = tilts[1:] - np.arctan(np.diff(speeds) / np.diff(loop))  # of gravity and acceleration [g]
        return rates, tilt_filter(loop, rates, directions, time_constant, tilts[0])

    shifts = period * np.linspace(-0.3, 0.3, 25)
    shifted = np.array([seen(instants + shift)[1] for shift in shifts])
    expected = np.array([np.interp(late[k], shifts, shifted[:, k]) for k in range(1201)])
    rates, tilts = seen(times)
    even = evened(times, np.column_stack([tilts, rates]), pushes[:-1], period, [0], [1], uneven=True)
    readings = np.zeros((1201, 4))
    readings[:, 0] = tilts
    loop = UnevenLoop(times, late / period, pushes[:-1], readings, uneven_sum(even, rates))
    made_up = loop.read(np.log1p(period / time_constant) / period, period)[:, 0]
    np.testing.assert_array_equal(loop.read(0.0, period), readings)
    before, after = (np.std((each - expected)[10:]) for each in (tilts, made_up))
    assert after < 0.65 * before


def test_a_part_of_an_uneven_loop_has_what_was_sent_and_read_in_it(paper):
    recording = uneven(paper)
    part = recording.part(50, 120)
    assert part.uneven.instants == pytest.approx(recording.uneven.instants[50:121] - recording.uneven.instants[50])
    np.testing.assert_array_equal(part.uneven.lateness, recording.uneven.lateness[50:121])
    np.testing.assert_array_equal(part.uneven.commands, recording.uneven.commands[50:120])
    np.testing.assert_array_equal(part.readings, recording.readings[50:121])


def test_other_commands_of_an_uneven_loop_act_in_the_mean_of_each_period(paper):
    recording = uneven(paper)
    same = recording.commanded(lambda sent: sent)
    np.testing.assert_allclose(same.commands, recording.commands, atol=1e-9)
    fine = np.linspace(0.0, 100 * 0.02, 100 * 2000, endpoint=False) + 0.5e-5
    sent = np.arange(200.0) % 7
    other = recording.commanded(lambda _: sent)
    instants = 0.02 * (np.arange(201) + recording.uneven.lateness)
    acting = sent[np.maximum(np.searchsorted(instants, fine, side="right") - 1, 0)]
    np.testing.assert_allclose(other.commands[1:100], acting.reshape(100, 2000).mean(axis=1)[1:], atol=0.01)


@pytest.mark.parametrize("begin", [0, 50])
def test_the_commands_of_an_uneven_loop_act_in_the_parts_of_a_period_that_they_reach(begin, paper):
    whole = uneven(paper)
    loop, parts, fine = whole.uneven, 20, 200
    even = loop.instants[begin:150] - 0.02 * loop.lateness[begin:150]
    within = np.arange((len(even) - 1) * parts * fine) / (parts * fine)
    moments = np.interp(within, np.arange(len(even)), even)
    acting = loop.commands[np.maximum(np.searchsorted(loop.instants, moments, side="right") - 1, 0)]
    found = whole.part(begin, 150).commands_over(parts)[: len(even) - 1]
    np.testing.assert_allclose(found, acting.reshape(-1, parts, fine).mean(axis=2), atol=5 / fine)
    np.testing.assert_allclose(found.mean(axis=1), whole.commands[begin : begin + len(found)], atol=0.01)


def test_an_even_loop_held_each_command(paper):
    even = replace(uneven(paper), uneven=None)
    np.testing.assert_array_equal(even.commands_over(20), even.commands[:, None])


def uneven(robot):
    """A recording of a robot whose loop is late or early by a tenth of its period, by chance."""
    late = 0.002 * np.clip(np.random.default_rng(4).standard_normal(201), -3.0, 3.0)
    late[0] = 0.0
    times = 0.02 * np.arange(201) + late
    moving = np.zeros((201, 7))
    moving[:, 0] = times
    moving[:, 1], moving[:, 4] = 0.1 * np.sin(8.0 * times), 3.0 * np.sin(5.0 * times)
    moving[:, 2], moving[:, 5] = 0.8 * np.cos(8.0 * times), 15.0 * np.cos(5.0 * times)
    commands = np.random.default_rng(5).standard_normal(200)
    given = Episode(("tilt",), 0.02, moving, moving[:, 1:2], commands, Outcome.COMPLETED, Provenance("p", "robot"))
    (recording,) = read(robot, given)
    return recording
