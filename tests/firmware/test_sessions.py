"""Mutated sessions: the firmware is in the state that docs/protocol.md says, and its motors are on in one only."""

import math
import random
from ctypes import create_string_buffer

import pytest
from building import library, needs_compiler
from state_model import ARMED, StateModel

from twbal.link.decoder import Decoder, to_wire
from twbal.link.protocol import Arm, Command, Drive, Fault, Follow, Hello, Stop, Telemetry, Welcome

pytestmark = needs_compiler
ODD = (math.nan, math.inf, -math.inf, 3e38, -3e38, 1e-40)


def number(rng, scale):
    return rng.choice(ODD) if rng.random() < 0.06 else rng.uniform(-scale, scale)


def message(rng, seq):
    """What a host might say, and at times a word of the robot's own."""
    match rng.choices("hasxcfr", (2, 3, 1, 1, 8, 4, 0.5))[0]:
        case "h":
            return Hello(seq, 2 if rng.random() < 0.9 else rng.randrange(65536))
        case "a":
            return Arm(seq, rng.randrange(2**32), rng.choices(list(Drive), (6, 1, 4))[0])
        case "s" | "x":
            return Stop(seq)
        case "c":
            return Command(seq, number(rng, 30), number(rng, 20))
        case "f":
            heading = math.nan if rng.random() < 0.8 else number(rng, 3)
            return Follow(seq, number(rng, 1), number(rng, 1), heading, number(rng, 1))
        case _:
            return rng.choice((Fault(seq, "no"), Welcome(seq, 2, 20_000, 1.0, name="r"), Welcome(seq, 9)))


def mutated(rng, data):
    """Bytes flipped, lost, doubled or cut off; one frame in six."""
    if rng.random() > 1 / 6:
        return data
    data = bytearray(data)
    for _ in range(rng.randrange(1, 4)):
        at = rng.randrange(len(data) or 1)
        match rng.randrange(4):
            case 0 if data:
                data[at] ^= 1 << rng.randrange(8)
            case 1 if data:
                del data[at]
            case 2:
                data.insert(at, rng.randrange(256))
            case _:
                del data[at:]
    return bytes(data)


class Session:
    """The firmware and the model of it, told the same."""

    def __init__(self, seed):
        self.rng, self.robot, self.model = random.Random(seed), library(), StateModel()
        self.robot.robot_start(1)
        self.now, self.seq, self.armed = self.rng.randrange(2**30), self.rng.randrange(2**16), 0

    def drive(self, steps=10):
        for opening in (Hello(self.next(), 2), Arm(self.next(), 0, self.rng.choice((Drive.TORQUE, Drive.ON_BOARD)))):
            if self.rng.random() < 0.9:
                self.tell(to_wire(opening))
        for _ in range(steps):
            self.event()
        return self

    def next(self):
        """Numbers go up; some are repeated, late, or far ahead."""
        self.seq = (self.seq + self.rng.choices((1, 0, -1, 2**15, 5), (20, 1, 1, 0.3, 1))[0]) % 2**16
        return self.seq

    def event(self):
        rng = self.rng
        match rng.choices("mstp", (12, 2, 5, 0.3))[0]:
            case "m":
                self.tell(mutated(rng, to_wire(message(rng, self.next()))))
            case "s":
                tilt = rng.choice((0.0, 0.3, -0.5, 0.99, 1.01, -2.0, math.nan)) if rng.random() < 0.3 else 0.2
                rate = math.inf if rng.random() < 0.02 else 0.1
                self.robot.robot_sees(tilt, rate)
                self.model.sees(tilt, rate)
            case "t":
                self.pass_time(rng.choice((500, 5_000, 19_999, 20_001, 60_000, 100_000, 100_001, 400_000, 11_000_000)))
            case _:
                self.robot.robot_port_closed()
                self.model.port_closed()
        self.check()

    def tell(self, data):
        self.robot.robot_receive(data, len(data), self.now)
        self.model.receive(data, self.now)
        self.pass_time(self.rng.randrange(8_000))

    def pass_time(self, duration):
        self.now += duration
        self.robot.robot_run(self.now)
        self.model.run(self.now)

    def check(self):
        state, on = self.robot.robot_state(), bool(self.robot.robot_motors_may_be_on())
        assert state == self.model.state
        assert on == (state == ARMED)
        output = (self.robot.robot_total(), self.robot.robot_difference())
        assert all(abs(a - b) < 1e-5 for a, b in zip(output, self.model.output, strict=True))
        assert on or output == (0.0, 0.0)
        self.armed += on


def check_sessions(seeds):
    armed = sum(Session(seed).drive().armed for seed in seeds)
    assert armed > 2 * len(seeds)  # of ten instants: they do drive


def test_mutated_sessions_never_leave_the_motors_on_where_they_must_be_off():
    check_sessions(range(10_000))


@pytest.mark.slow
def test_a_million_mutated_sessions_never_leave_the_motors_on_where_they_must_be_off():
    check_sessions(range(10_000, 1_010_000))


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
            Session(seed).drive()


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
