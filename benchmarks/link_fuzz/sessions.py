"""Sessions of a host that says what it should not, over a line that breaks frames: the firmware beside its model."""

import math
import random
from collections.abc import Iterable
from ctypes import CDLL
from typing import NamedTuple, Self

from benchmarks.link_fuzz.state_model import ARMED, StateModel
from twbal.link.decoder import to_wire
from twbal.link.message import Message
from twbal.link.protocol import Arm, Command, Drive, Fault, Follow, Hello, Stop, Welcome

ODD = (math.nan, math.inf, -math.inf, 3e38, -3e38, 1e-40)


def number(rng: random.Random, scale: float) -> float:
    """A number within the scale, or an odd one."""
    return rng.choice(ODD) if rng.random() < 0.06 else rng.uniform(-scale, scale)


def message(rng: random.Random, seq: int) -> Message:
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
            return Follow(seq, number(rng, 1), number(rng, 1), heading, number(rng, 1), rng.choice((0, 0, 1, 255)))
        case _:
            return rng.choice((Fault(seq, "no"), Welcome(seq, 2, 20_000, 1.0, name="r"), Welcome(seq, 9)))


def mutated(rng: random.Random, data: bytes) -> bytes:
    """Bytes flipped, lost, doubled or cut off; one frame in six."""
    if rng.random() > 1 / 6:
        return data
    changed = bytearray(data)
    for _ in range(rng.randrange(1, 4)):
        at = rng.randrange(len(changed) or 1)
        match rng.randrange(4):
            case 0 if changed:
                changed[at] ^= 1 << rng.randrange(8)
            case 1 if changed:
                del changed[at]
            case 2:
                changed.insert(at, rng.randrange(256))
            case _:
                del changed[at:]
    return bytes(changed)


class Session:
    """The firmware and the model of it, told the same.

    Args:
        robot: `firmware/tests/harness.cpp` as a library.
        seed: of the session.

    Attributes:
        armed: after how many of its events the robot was armed.
        events: how many there were.
    """

    def __init__(self, robot: CDLL, seed: int) -> None:
        self.rng, self.robot, self.model = random.Random(seed), robot, StateModel()
        self.robot.robot_start(1)
        self.now, self.seq, self.armed = self.rng.randrange(2**30), self.rng.randrange(2**16), 0
        self.events = 0

    def drive(self, steps: int = 10) -> Self:
        """Some events; raises AssertionError where firmware and model differ."""
        for opening in (Hello(self.next(), 2), Arm(self.next(), 0, self.rng.choice((Drive.TORQUE, Drive.ON_BOARD)))):
            if self.rng.random() < 0.9:
                self.tell(to_wire(opening))
        for _ in range(steps):
            self.event()
        return self

    def next(self) -> int:
        """Numbers go up; some are repeated, late, or far ahead."""
        self.seq = (self.seq + self.rng.choices((1, 0, -1, 2**15, 5), (20, 1, 1, 0.3, 1))[0]) % 2**16
        return self.seq

    def event(self) -> None:
        """Something is said, seen, or waited for."""
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

    def tell(self, data: bytes) -> None:
        """Bytes reach the robot, and some time passes."""
        self.robot.robot_receive(data, len(data), self.now)
        self.model.receive(data, self.now)
        self.pass_time(self.rng.randrange(8_000))

    def held(self, duration: int) -> None:
        """The robot's loop is held for a time [µs], while something that the host says waits."""
        self.now += duration
        self.tell(to_wire(message(self.rng, self.next())))
        self.check()

    def pass_time(self, duration: int) -> None:
        """Nothing is said for a time [µs]."""
        self.now += duration
        self.robot.robot_run(self.now)
        self.model.run(self.now)

    def check(self) -> None:
        """Both are in one state, and give the motors the same."""
        state, on = self.robot.robot_state(), bool(self.robot.robot_motors_may_be_on())
        assert state == self.model.state
        assert on == (state == ARMED)
        output = (self.robot.robot_total(), self.robot.robot_difference())
        assert all(abs(a - b) < 1e-5 for a, b in zip(output, self.model.output, strict=True))
        assert on or output == (0.0, 0.0)
        self.armed += on
        self.events += 1


class Driven(NamedTuple):
    """What came of sessions.

    Attributes:
        sessions: how many.
        events: in them, after each of which firmware and model were compared.
        armed: of these, with the robot armed.
        wrong: sessions in which both differed.
    """

    sessions: int
    events: int
    armed: int
    wrong: int


def driven(robot: CDLL, seeds: Iterable[int]) -> Driven:
    """Drive the sessions of these seeds."""
    sessions = events = armed = wrong = 0
    for seed in seeds:
        session = Session(robot, seed)
        try:
            session.drive()
        except AssertionError:
            wrong += 1
        sessions, events, armed = sessions + 1, events + session.events, armed + session.armed
    return Driven(sessions, events, armed, wrong)
