"""A command that answers a speed which no loop of the log's rows measures is a question; any other is none."""

import numpy as np
import pytest
import yaml
from foreign_logs import PERIOD, text

from twbal.io.importers.guess import guess

ROWS, FINE = 800, 10
"""Rows of a log, and loops for each of them where the loop runs faster."""


def signals(rows=ROWS):
    """Tilt and wheels of a robot at each of the loops, by chance; the wheels in ticks."""
    rng = np.random.default_rng(2)
    count = (rows + 40) * FINE
    smooth = [np.convolve(rng.standard_normal(count), np.hanning(width), mode="same") for width in (400, 200)]
    tilt, rates = 0.01 * smooth[0] / np.std(smooth[0]), 3.0 * smooth[1] / np.std(smooth[1])
    tick = 2 * np.pi / 2000
    return tilt, tick * np.floor(np.cumsum(PERIOD / FINE * rates) / tick)


@pytest.fixture
def looked_at(tmp_path):
    def look(speed, command, tilt, angle, names=("speed [m/s]", "torque"), more=()):
        columns = np.column_stack([PERIOD * np.arange(len(tilt)), tilt, angle, speed, command, *more])[20:]
        path = tmp_path / "log.csv"
        extra = [f"speed_ref_{k} [m/s]" for k in range(len(more))]
        path.write_text(text(columns, names=("time", "tilt", "wheel_angle", *names, *extra)))
        return yaml.safe_load(guess(path).mapping)["command_is_sample"], guess(path)

    return look


def test_a_speed_that_is_measured_between_rows_and_answered_makes_it_a_question(looked_at):
    tilt, angle = signals()
    speed = 0.03 * np.diff(angle, prepend=angle[:1]) * FINE / PERIOD
    command = 20 * tilt + 5 * speed
    found, told = looked_at(speed[::FINE], command[::FINE], tilt[::FINE], angle[::FINE])
    assert found == "???"
    assert "the command answers speed [m/s], a speed that is no change of the wheels' path" in told.mapping
    assert any(line.startswith("command_is_sample (") for line in told.open)


@pytest.mark.parametrize("rows", [1, 3])
@pytest.mark.parametrize("late", [0, 1])
def test_a_speed_of_the_rows_is_none_and_nor_is_a_command_of_the_row_before(rows, late, looked_at):
    """With a noise that excites the robot, too."""
    tilt, angle = (values[::FINE] for values in signals())
    speed = 0.03 * (angle - np.roll(angle, rows)) / (rows * PERIOD)
    command = np.roll(20 * tilt + 5 * speed + 0.1 * np.random.default_rng(3).standard_normal(len(tilt)), late)
    assert looked_at(speed, command, tilt, angle)[0] is False


def test_a_speed_that_is_filtered_from_row_to_row_is_none(looked_at):
    tilt, angle = (values[::FINE] for values in signals())
    changes = 0.03 * np.diff(angle, prepend=angle[:1]) / PERIOD
    speed = np.zeros(len(changes))
    for k in range(1, len(changes)):
        speed[k] = 0.9 * speed[k - 1] + 0.1 * changes[k]
    assert looked_at(speed, 20 * tilt + 5 * speed, tilt, angle)[0] is False


def test_a_speed_that_is_asked_for_is_none(looked_at):
    """The wheels follow it, and the command answers it; its name says what it is, or its numbers."""
    tilt, angle = (values[::FINE] for values in signals())
    speed = 0.03 * np.diff(angle, prepend=angle[:1]) / PERIOD
    asked = np.convolve(speed, np.ones(9) / 9, mode="same")
    command = 20 * tilt + 5 * (asked - speed)
    assert looked_at(speed, command, tilt, angle, more=[asked])[0] is False
    assert looked_at(asked, command, tilt, angle)[0] is False


def test_ticks_and_rounded_angles_are_no_reason(looked_at):
    """The loop differences finer numbers than those that it writes."""
    tilt, angle = (values[::FINE] for values in signals())
    speed = 0.03 * np.diff(angle, prepend=angle[:1]) / PERIOD
    assert looked_at(speed, 20 * tilt + 5 * speed, tilt, np.round(angle, 2))[0] is False


def test_a_short_log_asks_nothing(looked_at):
    tilt, angle = signals(100)
    speed = 0.03 * np.diff(angle, prepend=angle[:1]) * FINE / PERIOD
    assert looked_at(*(values[::FINE] for values in (speed, 20 * tilt + 5 * speed, tilt, angle)))[0] is False
