"""Voltages beyond the supply, motors that are not those of the sheet, and commands without their direction."""

from dataclasses import replace

import numpy as np
import pytest
from foreign_logs import PERIOD, columns

from twbal.core.channels import Channels
from twbal.core.episode import Provenance
from twbal.core.motor import Motor
from twbal.io.importers.checks.doubt import LogPart
from twbal.io.importers.checks.implausible_values import one_way_doubts
from twbal.io.importers.checks.motor_doubts import stall_doubts, voltage_doubts
from twbal.io.importers.conversion import Wanted, import_file
from twbal.io.importers.mapping import mapping

MOTOR = Motor(resistance=2.0, torque_constant=0.05, gear=20.0, supply=12.0)  # 6 N·m at standstill
RADIUS = 0.1
TIME = 0.01 * np.arange(2000)
BALANCING = {"tilt": 0.05 * np.sin(3.0 * TIME), "wheel_angle": 2.0 * np.sin(2.0 * TIME)}
FALLING = {"tilt": 0.01 * np.exp(0.2 * TIME), "wheel_angle": 0.1 * np.exp(0.2 * TIME)}


def part(signals, commands, robot=None):
    return LogPart(PERIOD, signals, commands[1:], {}, False, False, robot)


@pytest.mark.parametrize(
    ("commands", "lacks"),
    [
        (np.abs(np.sin(5.0 * TIME)), "never negative"),
        (-np.abs(np.sin(5.0 * TIME)), "never positive"),
        (1.0 + np.sign(np.sin(5.0 * TIME)), "never negative"),
        (128.0 + 40.0 * np.sin(5.0 * TIME), "never negative"),
    ],
    ids=["size", "size that is turned", "full or none", "offset"],
)
def test_commands_without_their_direction_are_doubted(commands, lacks):
    (found,) = one_way_doubts(part(BALANCING, commands))
    assert (
        f"the command is {lacks}: is it the size of a duty cycle, whose direction stands in another" in found.sentence
    )
    assert "an offset (0..255 with rest at 128)?" in found.sentence


def test_commands_of_a_robot_that_falls_or_of_both_signs_are_not_doubted():
    assert not list(one_way_doubts(part(FALLING, 0.01 * np.exp(0.2 * TIME))))
    assert not list(one_way_doubts(part(BALANCING, np.sin(5.0 * TIME))))
    assert not list(one_way_doubts(part(BALANCING, 0.5 + np.sin(5.0 * TIME))))


def test_the_share_of_the_voltages_beyond_the_supply_is_said():
    duty = np.linspace(0.0, 2.25, 1001)
    (found,) = voltage_doubts(12.0 * duty, MOTOR, True, PERIOD)
    assert "55 % of the voltages were beyond the supply (up to 225 % of it) and were clipped" in found.sentence
    assert "is the duty in other units (0.1 %, 0..255)?" in found.sentence
    (found,) = voltage_doubts(12.0 * duty, MOTOR, False, PERIOD)
    assert "is the unit, the scale or the supply another?" in found.sentence


@pytest.mark.parametrize(("largest", "is_duty", "is_doubted"), [(1.3, True, 1), (1.3, False, 0), (1.05, True, 0)])
def test_one_duty_cycle_that_no_log_has_is_enough(largest, is_duty, is_doubted):
    volts = np.append(np.sin(TIME), largest) * 12.0
    assert len(list(voltage_doubts(volts, MOTOR, is_duty, PERIOD))) == is_doubted


@pytest.mark.parametrize(
    ("limit", "largest", "is_doubted"),
    [(6.0, 6.0, 0), (12.0, 6.0, 1), (7.5, 6.0, 0), (3.0, 3.0, 0), (3.0, 6.0, 1), (1.0, 6.0, 0)],
    ids=["alike", "of one motor", "within 30 %", "limited by the firmware", "beyond that", "said elsewhere"],
)
def test_a_motor_that_is_not_that_of_the_sheet_is_doubted(limit, largest, is_doubted, paper):
    commands = largest * np.sin(5.0 * TIME) / np.abs(np.sin(5.0 * TIME)).max()
    found = list(stall_doubts(part(BALANCING, commands, replace(paper, torque_limit=limit)), MOTOR))
    assert len(found) == is_doubted
    assert not found or "R must be half of one motor's where two are meant" in found[0].sentence
    assert not list(stall_doubts(part(BALANCING, commands), MOTOR))


def test_an_import_says_what_it_clips(tmp_path, paper):
    rows = columns()
    time, tilt, wheel = rows[:, 0], rows[:, 1], rows[:, 5]
    path = tmp_path / "log.csv"
    np.savetxt(path, np.column_stack([time, tilt, wheel, 225.0 * np.sin(5.0 * time)]), delimiter=",")
    told = {"time": {"from": 1}, "tilt": {"from": 2}, "wheel_angle": {"from": 3}, "voltage": {"from": 4, "unit": "%"}}
    wanted = Wanted(lambda _: Channels(("tilt", "tilt_rate", "speed"), RADIUS), None, 50, paper)
    found = import_file(
        path, mapping(told, [], None, False, False, 0.0, 3, motor=MOTOR), wanted, Provenance("mine", "robot")
    )
    assert np.abs(found.episodes[0].commands).max() == pytest.approx(6.0)
    said = " ".join(doubt.sentence for doubt in found.doubts)
    assert "(up to 225 % of it) and were clipped" in said
    assert "the mapping's motor gives 6 N·m at standstill" in said
