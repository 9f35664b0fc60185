"""Motions by hand of a robot whose sensors are wrong in known ways: each wrong sign or scale is found."""

import math

import pytest
from held_robot import HeldRobot
from pendulum import MemoryTransport

from twbal.link.checks.by_hand import Helper, by_hand_checks
from twbal.link.protocol import Clock
from twbal.link.serial_plant import SerialPlant
from twbal.virtual_robot.firmware import Firmware, Identity

SECONDS = 2.0
SIGHT = dict.fromkeys(("tilt", "rate", "left", "right", "yaw"), 1.0)


def smooth(seconds):
    """From 0 to 1 in the first half of the time, and its rate [1/s]."""
    x = min(max(2 * seconds / SECONDS, 0.0), 1.0)
    return 3 * x**2 - 2 * x**3, (6 * x - 6 * x**2) * 2 / SECONDS if x < 1.0 else 0.0


def tried(version=2, swapped=False, lazy=False, turns=1.0, again=lambda found: False, told=None, **factors):
    """Verdicts of a robot that shows its tilt, tilt rate and wheels times a factor each."""
    see, robot = {**SIGHT, **factors}, HeldRobot(bias=0.0)

    def person(what):
        is_lazy = lazy(what) if callable(lazy) else lazy

        def motion(seconds):
            far, fast = smooth(seconds) if not is_lazy else (0.0, 0.0)
            lean = math.radians(20.0) * ("lean" in what)
            turning = see["yaw"] * math.pi / 2 * fast * ("TO THE LEFT" in what)
            left, right = (2 * math.pi * turns * far * (f"the {side}" in what) for side in ("LEFT", "RIGHT"))
            left, right = (right, left) if swapped else (left, right)
            return (
                see["tilt"] * lean * far,
                see["rate"] * lean * fast,
                see["left"] * left,
                see["right"] * right,
                turning,
            )

        robot.motion = motion

    helper = Helper(person, again, (told if told is not None else []).append)
    line = MemoryTransport(Firmware(robot, Identity("held", 4.0, 1.0, 0.1, Clock.LOCKSTEP, version)))
    checks = by_hand_checks(SerialPlant(line, 1.0, 1.0, 1.0), SECONDS, helper)
    return {check.name.removesuffix(" sign"): check for check in checks}


def verdicts(found):
    return [found[name].verdict for name in ("tilt", "left wheel", "right wheel", "yaw rate")]


@pytest.mark.parametrize("version", [1, 2])
def test_a_good_robot_passes(version):
    found = tried(version)
    assert verdicts(found) == ["ok"] * 4
    assert "changed by +20" in found["tilt"].found


@pytest.mark.parametrize(
    "wrong", [{"tilt": -1.0, "rate": -1.0}, {"rate": -1.0}, {"tilt": -1.0}, {"rate": 180 / math.pi}]
)
def test_a_wrong_sign_or_unit_of_tilt_or_rate_is_found(wrong):
    assert verdicts(tried(**wrong)) == ["problem", "ok", "ok", "ok"]


@pytest.mark.parametrize("wrong", [{"rate": 0.0}, {"tilt": 0.0}])
def test_a_tilt_or_a_rate_that_stands_still_is_found(wrong):
    assert verdicts(tried(**wrong)) == ["problem", "ok", "ok", "ok"]


def test_an_encoder_that_counts_backward_is_found_by_its_side():
    assert verdicts(tried(left=-1.0)) == ["ok", "problem", "ok", "ok"]
    assert verdicts(tried(right=-1.0)) == ["ok", "ok", "problem", "ok"]


def test_swapped_encoders_are_found():
    found = tried(swapped=True)
    assert verdicts(found) == ["ok", "problem", "problem", "ok"]
    assert "swap left and right encoder" in found["left wheel"].advice


def test_a_wrong_number_of_ticks_is_a_warning():
    found = tried(turns=2.0)
    assert verdicts(found) == ["ok", "warning", "warning", "ok"]
    assert "+720°" in found["left wheel"].found


@pytest.mark.parametrize(
    ("factor", "verdict", "said"),
    [
        (-1.0, "problem", "sign of the yaw rate"),
        (math.pi / 180, "problem", "axes"),
        (180 / math.pi, "problem", "rad/s"),
        (2.0, "warning", "range"),
    ],
)
def test_a_wrong_sign_or_unit_of_the_yaw_rate_is_found(factor, verdict, said):
    found = tried(yaw=factor)
    assert verdicts(found) == ["ok", "ok", "ok", verdict]
    assert said in found["yaw rate"].advice


def test_a_robot_of_version_1_without_a_yaw_rate_has_no_problem():
    assert verdicts(tried(version=1, yaw=0.0)) == ["ok", "ok", "ok", "skipped"]
    assert verdicts(tried(version=2, yaw=0.0))[3] == "problem"


def test_who_does_nothing_is_asked_whether_it_was_done():
    found = tried(lazy=True)
    assert verdicts(found) == ["problem"] * 4
    assert all("Did you" in check.advice for check in found.values())


def test_a_slip_is_told_at_once_and_made_good_by_doing_it_once_more():
    slips, shown, told = {"LEFT": 1}, [], []

    def lazy(what):
        slips["LEFT"] -= "the LEFT" in what
        return "the LEFT" in what and slips["LEFT"] == 0

    found = tried(lazy=lazy, again=lambda line: shown.append(line) or True, told=told)
    assert verdicts(found) == ["ok"] * 4
    assert len(shown) == 1
    assert "Did you turn it?" in shown[0]
    assert [line.split()[1] for line in told] == ["tilt", "left", "right", "yaw"]


def test_who_does_not_do_it_once_more_keeps_the_problem():
    assert verdicts(tried(lazy=lambda what: "the RIGHT" in what)) == ["ok", "ok", "problem", "ok"]
