"""Parts of the checks of logs against closed forms: repeated rows, scales of single columns."""

import numpy as np
import pytest

from twbal.core.errors import ConfigError
from twbal.io.importers.checks.doubt import LogPart
from twbal.io.importers.checks.frozen import frozen_doubts
from twbal.io.importers.checks.implausible_values import constant_doubts, tilt_doubts, torque_doubts
from twbal.io.importers.checks.jumps import without_jumps
from twbal.io.importers.checks.repeated_rows import held_doubts, longest_repeat, rows_held
from twbal.io.importers.columns import Columns
from twbal.io.importers.mapping import mapping


def test_a_block_that_comes_again_is_found_and_chance_is_not():
    rng = np.random.default_rng(1)
    tilt = np.round(np.cumsum(rng.standard_normal(1000)), 1)
    assert longest_repeat({"tilt": tilt}) is None
    assert longest_repeat({"tilt": np.zeros(1000)}) is None
    again = np.concatenate([tilt, tilt[300:500]])
    first, second, count = longest_repeat({"tilt": again})
    assert (first, second, count) == (300, 1000, 200)


@pytest.mark.parametrize("times", [2, 5])
def test_rows_that_all_come_again_at_once_are_doubted(times):
    """The log of a loop that writes more often than the robot measures, also with a column of time."""
    tilt = np.repeat(0.1 * np.random.default_rng(3).standard_normal(200), times)
    signals = {"time": 0.01 * np.arange(len(tilt)), "tilt": tilt, "wheel_rate": 3.0 * tilt}
    part = LogPart(0.01, signals, tilt[1:], {}, False, False, None)
    (found,) = held_doubts(part, 1)
    assert not list(held_doubts(part, times))  # the import takes one of each
    assert f"each row comes {times} times in a row" in found.sentence
    assert f"period={0.01 * times:.3g}." in found.sentence


def test_sensors_at_rest_and_rows_that_change_are_no_rows_held():
    rng = np.random.default_rng(4)
    assert rows_held({"tilt": rng.standard_normal(200)}) == 1
    assert rows_held({"tilt": np.round(0.4 * rng.standard_normal(400))}) == 1
    assert rows_held({"tilt": np.repeat(rng.standard_normal(200), rng.integers(1, 4, 200))}) == 1
    assert rows_held({"tilt": np.zeros(400)}) == 1


@pytest.mark.parametrize(
    ("quantity", "unit", "plain"),
    [("tilt_rate", "dps", "deg/s"), ("command", "N m", "N·m"), ("command", "mN·m", "mNm"), ("command", "mN m", "mNm")],
)
def test_units_may_be_written_in_several_ways(quantity, unit, plain):
    def made(unit):
        told = {"time": {"from": 1}, "tilt": {"from": 2}, "wheel_angle": {"from": 3}, "command": {"from": 4}}
        told[quantity] = {"from": 5, "unit": unit}
        return mapping(told, [], None, False, False, 0.0, 3).quantities[quantity]

    assert made(unit) == made(plain)


def test_two_columns_may_have_a_scale_each():
    told = {"time": {"from": 1}, "tilt": {"from": 2}, "command": {"from": 3}}
    wheels = {"from": [4, 5], "scale": [1, -2]}
    made = mapping({**told, "wheel_angle": wheels}, [], None, False, False, 0.0, 3)
    values = np.array([[0.0, 0.1, 1.0, 3.0, -1.0]])
    signals = made.signals(Columns(values, np.array([1]), np.array([0]), "row", ()))
    assert signals["wheel_angle"] == pytest.approx([2.5])
    assert (signals["left wheel_angle"][0], signals["right wheel_angle"][0]) == (3.0, 2.0)
    with pytest.raises(ConfigError, match="has 1 scales for 2 columns"):
        mapping({**told, "wheel_angle": {"from": [4, 5], "scale": [1]}}, [], None, False, False, 0.0, 3)


def test_two_wheels_that_cancel_out_are_told_from_a_sensor_that_was_off():
    turned = np.arange(5.0)
    (found,) = constant_doubts({"wheel_angle": np.zeros(5)}, {"wheel_angle": (turned, -turned)})
    assert "each moves: give each its scale" in found.sentence
    (found,) = constant_doubts({"wheel_angle": np.zeros(5)}, {})
    assert "its sensor was off" in found.sentence


@pytest.mark.parametrize(("largest", "is_doubted"), [(19.0, False), (45.0, False), (255.0, True)])
def test_commands_far_beyond_the_torque_limit_are_doubted(paper, largest, is_doubted):
    """The sheet has 20 N·m; of steps of a timer that were taken for N·m nothing else need be wrong."""
    commands = largest * np.sin(np.arange(50.0))
    part = LogPart(0.02, {}, commands * largest / np.abs(commands).max(), {}, False, False, paper)
    found = list(torque_doubts(part))
    assert [doubt.quantity for doubt in found] == ["command"] * is_doubted
    assert not list(torque_doubts(part._replace(robot=None)))


@pytest.mark.parametrize(("upright", "offset"), [(np.pi, "-3.142"), (-0.5 * np.pi, "1.571"), (2.4, None)])
def test_a_tilt_that_is_counted_from_hanging_or_from_lying_is_told_with_its_offset(upright, offset, paper):
    """Books count the angle of a pendulum from where it hangs; where it stands, it is half a turn."""
    tilt = upright + 0.3 * np.sin(0.1 * np.arange(300.0))
    part = LogPart(0.01, {"tilt": tilt}, np.zeros(299), {}, False, False, paper)
    (found,) = tilt_doubts(part)
    assert "is it in degrees, or another column" in found.sentence
    assert ("(mend `offset`" in found.sentence) == (offset is not None)
    assert offset is None or f"`offset`: {offset})" in found.sentence


def test_a_tilt_of_whole_turns_may_be_in_hundredths_of_a_degree(paper):
    tilt = 10.0 * np.sin(0.1 * np.arange(300.0))
    (found,) = tilt_doubts(LogPart(0.01, {"tilt": tilt}, np.zeros(299), {}, False, False, paper))
    assert "is it in degrees, or in hundredths of a degree, or another column?" in found.sentence


def moving(seconds=20.0, period=0.01, seed=5):
    """A log of smooth motions with the noise of sensors: tilt, its rate, the wheels, and the command."""
    rng, time = np.random.default_rng(seed), np.arange(0.0, seconds, period)
    tilt = 0.05 * np.sin(3.0 * time) + 0.02 * np.sin(7.1 * time)
    rate = np.gradient(tilt, period)
    noisy = {
        "tilt": tilt + 1e-4 * rng.standard_normal(len(time)),
        "tilt_rate": rate + 1e-3 * rng.standard_normal(len(time)),
        "wheel_angle": np.round((8.0 * np.sin(1.1 * time) - tilt) / 0.01) * 0.01,
    }
    command = 2.0 * tilt + 0.3 * rate + 0.01 * rng.standard_normal(len(time))
    return {"time": time, **noisy}, command


def frozen(signals, command, names, begin, end):
    """What is said where channels keep the value that they had at `begin` [s], until `end`."""
    of_log = {name: values.copy() for name, values in signals.items()}
    rows = (of_log["time"] >= begin) & (of_log["time"] < end)
    for name in names:
        of_log[name][rows] = of_log[name][np.argmax(rows)]
    return [doubt.sentence for doubt in frozen_doubts(LogPart(0.01, of_log, command[:-1], {}, False, False, None))]


@pytest.mark.parametrize(("begin", "end"), [(3.0, 20.0), (8.0, 10.0), (12.0, 12.5)])
def test_an_imu_that_hangs_in_mid_log_is_told_with_its_times(begin, end):
    (sentence,) = frozen(*moving(), ["tilt", "tilt_rate"], begin, end)
    assert f"stand still from {begin:g} s to {end - 0.01:.6g} s" in sentence
    assert "the IMU was not read" in sentence


def test_an_encoder_that_comes_loose_is_told():
    (sentence,) = frozen(*moving(), ["wheel_angle"], 12.0, 20.0)
    assert "wheel_angle stands still from 12 s" in sentence


def test_sensors_that_work_and_robots_at_rest_are_not_told_of():
    signals, command = moving()
    assert frozen(signals, command, [], 0.0, 0.0) == []
    assert frozen(signals, command, ["tilt_rate"], 5.0, 6.0) == []  # the tilt goes on: no IMU that hangs
    resting = command.copy()
    resting[:500] = 0.0
    assert frozen(signals, resting, ["tilt", "tilt_rate", "wheel_angle"], 0.0, 5.0) == []
    coarse = {**signals, "tilt": np.round(signals["tilt"], 2), "tilt_rate": np.round(signals["tilt_rate"], 1)}
    assert frozen(coarse, command, [], 0.0, 0.0) == []


@pytest.mark.parametrize("offset", [0.0, np.pi])
def test_a_tilt_that_wraps_round_is_told_so_and_nothing_else_of_it(offset, paper):
    signals, command = moving()
    wrapped = {**signals, "tilt": np.mod(signals["tilt"], 2.0 * np.pi) - offset}  # from 0, or of an IMU upside down
    doubts, mended = without_jumps(LogPart(0.01, wrapped, command[:-1], {}, False, False, paper))
    (doubt,) = doubts
    assert "it wraps round" in doubt.sentence and "wraps: 360" in doubt.sentence
    np.testing.assert_allclose(np.diff(mended.signals["tilt"]), np.diff(signals["tilt"]), atol=1e-9)
