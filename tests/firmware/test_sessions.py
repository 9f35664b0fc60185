"""Mutated sessions: the firmware is in the state that docs/protocol.md says, and its motors are on in one only."""

import math
from ctypes import create_string_buffer

import pytest
from building import library, needs_compiler

from benchmarks.link_fuzz.sessions import Session, driven
from benchmarks.link_fuzz.state_model import StateModel
from twbal.link.decoder import Decoder, to_wire
from twbal.link.protocol import Arm, Command, Hello, Stop, Telemetry

pytestmark = needs_compiler


def check_sessions(seeds):
    found = driven(library(), seeds)
    assert (found.sessions, found.wrong) == (len(seeds), 0)
    assert found.armed > 2 * len(seeds)  # of ten instants: they do drive


def test_mutated_sessions_never_leave_the_motors_on_where_they_must_be_off():
    check_sessions(range(3_000))


def test_what_waited_while_the_loop_was_held_is_judged_by_the_watchdog_first():
    for seed in range(3_000):
        session = Session(library(), seed).drive(4)
        session.held(session.rng.choice((5_000, 60_000, 99_000, 100_001, 190_000, 400_000, 11_000_000)))


def test_a_command_that_waited_for_longer_than_the_watchdog_moves_nothing():
    robot = library()
    robot.robot_start(1)
    for message, now in ((Hello(1, 2), 10), (Arm(2, 5), 1000), (Command(3, 2.0, 0.0), 2000)):
        robot.robot_receive(to_wire(message), len(to_wire(message)), now)
    late = to_wire(Command(4, 2.0, 0.0))
    robot.robot_receive(late, len(late), 102_001)
    assert not robot.robot_motors_may_be_on() and robot.robot_total() == 0.0
    robot.robot_run(102_001)
    assert not robot.robot_motors_may_be_on()


@pytest.mark.slow
def test_a_million_mutated_sessions_never_leave_the_motors_on_where_they_must_be_off():
    check_sessions(range(3_000, 1_003_000))


@pytest.mark.parametrize("step", ["forget the watchdog", "forget the tilt", "forget Stop"])
def test_a_model_that_forgets_a_rule_is_told_apart(step, monkeypatch):
    """The comparison would see a firmware that differs by one rule."""
    broken = {
        "forget the watchdog": ("_watch", lambda self, now: None),
        "forget the tilt": ("_look", lambda self: None),
        "forget Stop": ("_take", _without_stop(StateModel._take)),
    }[step]
    monkeypatch.setattr(StateModel, *broken)
    with pytest.raises(AssertionError):
        for seed in range(300):
            Session(library(), seed).drive()


def _without_stop(take):
    def deaf(self, message, now):
        if not isinstance(message, Stop):
            take(self, message, now)

    return deaf


def test_words_travel_between_both_languages():
    """What the robot says is read by the host's decoder, value by value."""
    robot = library()
    robot.robot_start(1)
    robot.robot_sees(0.125, -0.5)
    sent = create_string_buffer(65536)
    for wire, now in (
        (to_wire(Hello(1, 2)), 10),
        (to_wire(Arm(2, 5)), 1000),
        (to_wire(Command(3, 25.0, 1.0)), 1500),
        (to_wire(Command(4, math.nan)), 1600),
    ):
        robot.robot_receive(wire, len(wire), now)
    robot.robot_run(21_500)
    count = robot.robot_sent(sent)
    heard = Decoder(2).feed(sent.raw[:count])
    welcome, armed, fault, driven = heard
    assert (welcome.name, welcome.control_period_us, welcome.torque_limit) == ("fake", 20_000, 20.0)
    assert (welcome.difference_limit, welcome.policy) == (10.0, 7)
    assert math.isnan(welcome.voltage_limit)
    assert isinstance(armed, Telemetry) and (armed.seq, armed.period, armed.time_us) == (2, 0, 1000)
    assert (fault.seq, fault.text) == (4, "the command is not a finite number")
    assert (driven.seq, driven.period, driven.time_us, driven.command_us) == (4, 1, 21_000, 1500)
    assert (driven.tilt, driven.tilt_rate, driven.applied, driven.applied_difference) == (0.125, -0.5, 20.0, 0.0)
    assert math.isnan(driven.heading)
    assert driven.status.name == "ARMED|LIMITED"
