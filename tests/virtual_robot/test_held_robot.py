"""A robot in a hand: it passes `check-link` where the hand does what is asked for."""

import math
import subprocess
import sys
from contextlib import closing

import numpy as np
import pytest

from twbal.link.checks.by_hand import Helper
from twbal.link.checks.procedure import LinkTrial, check_link
from twbal.link.serial_plant import SerialPlant
from twbal.virtual_robot.held_robot import HeldRobot

TRIAL = LinkTrial(exchanges=20, rest=0.5, pulse=0.1, pulse_time=0.3, is_held=True, by_hand=True, hand_time=2.5)


def driven(robot, seconds, command=0.0):
    return [robot.step(command) for _ in range(round(seconds / robot.control_period))]


@pytest.fixture
def typed():
    """What is typed next."""
    return []


@pytest.fixture
def held(paper, typed):
    return HeldRobot(paper, lambda: typed.pop() if typed else "")


def test_it_leans_and_leans_back_and_its_gyro_is_the_rate_of_its_tilt(held, typed):
    typed.append("l")
    seen = driven(held, 2.0)
    assert math.degrees(seen[-1].tilt - seen[0].tilt) == pytest.approx(20.0, abs=0.3)
    rates = np.array([each.tilt_rate for each in seen])
    assert (rates - 0.01).sum() * held.control_period == pytest.approx(math.radians(20.0), abs=0.01)
    typed.append("l")
    assert driven(held, 2.0)[-1].tilt == pytest.approx(0.02, abs=0.005)


@pytest.mark.parametrize(("key", "side"), [("a", -1.0), ("d", 1.0)])
def test_a_wheel_is_turned_once_and_stays_there_until_the_next_arming(key, side, held, typed):
    typed.append(key)
    seen = driven(held, 2.0)
    assert seen[-1].wheel_angle == pytest.approx(math.pi)
    assert held.wheel_difference().angle == pytest.approx(side * math.tau)
    assert held.reset(1).wheel_angle == pytest.approx(math.pi)


def test_turned_to_the_left_its_yaw_rate_adds_up_to_a_quarter_and_no_wheel_turns(held, typed):
    typed.append("t")
    seen = driven(held, 2.0)
    assert sum(each.yaw_rate for each in seen) * held.control_period == pytest.approx(math.pi / 2, abs=0.01)
    assert (seen[-1].wheel_angle, held.wheel_difference().angle) == (0.0, 0.0)


def test_torques_turn_each_wheel_to_the_speed_at_which_its_drag_is_the_torque(held, paper):
    held.reset(0)
    held.steer(0.4)
    seen = driven(held, 5.0, 1.0)
    fastest = paper.torque_limit / 2.0 / 30.0  # drag of a wheel [N m s]
    assert seen[-1].wheel_rate == pytest.approx(0.5 / fastest, rel=1e-3)
    assert held.wheel_difference().rate == pytest.approx(0.4 / fastest, rel=1e-3)


def test_its_wheels_turn_in_parts_of_a_period_as_in_all_of_it(held):
    whole = [held.step(2.0 + k).wheel_angle for k in range(5)]
    held.reset(0)
    for k, expected in enumerate(whole):
        held.drive_until(0.003, 2.0 + k)
        held.drive_until(0.017, 2.0 + k)
        assert held.step(2.0 + k).wheel_angle == pytest.approx(expected, rel=1e-12)


def test_it_hangs_where_that_is_typed(paper):
    typed, waited = ["h"], []
    robot = HeldRobot(paper, lambda: typed.pop() if typed else "", waited.append)
    robot.step(0.0)
    assert waited == [3.0]


@pytest.mark.slow
def test_check_link_passes_over_a_port_where_the_hand_does_what_it_asks_for():
    command = [sys.executable, "-m", "twbal", "virtual-robot", "held=true", "clock=real_time", "robot=esp32"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1) as process:
        try:
            lines = [process.stdout.readline()]
            while not lines[-1].startswith("port "):
                lines.append(process.stdout.readline())
            assert lines[0].strip().startswith("l and Enter: lean")
            keys = {"lean": "l", "the LEFT": "a", "the RIGHT": "d", "TO THE LEFT": "t"}

            def ask(what):
                process.stdin.write(next(key for word, key in keys.items() if word in what) + "\n")
                process.stdin.flush()

            plant = SerialPlant.open(lines[-1].split()[1], 921600, 5.0, 10.0, 2.0)
            with closing(plant):
                helper = Helper(ask, lambda found: False, lambda line: None)
                report = check_link(plant, TRIAL, lambda line: None, helper)
            verdicts = {check.name: str(check.verdict) for check in report.checks}
            by_hand = ("tilt sign", "left wheel sign", "right wheel sign", "yaw rate sign", "sensors at rest")
            assert {verdicts[name] for name in (*by_hand, "torque sign", "difference sign", "stop")} == {"ok"}, report
        finally:
            process.terminate()
    assert process.returncode == 0
