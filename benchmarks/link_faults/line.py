"""The line between host and robot: two pseudo-terminals, with faults between them, and a record of what passed."""

import math
import os
import pty
import select
import time
import tty
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from benchmarks.link_faults.frames import STOP, Cutter, Said, number_in, said_in, total_in

_ABSENT = 0.01  # how often to look for a port that is away [s]


@dataclass
class Passed:
    """What the line saw of a trial.

    Attributes:
        sent: telemetry as it left the robot, with the instant [s]; this and what follows: since it was armed last.
        heard: telemetry that reached the host whole, with the instant at which it had [s].
        commanded: torques of the host's commands, as they left it, by their numbers.
        asked: when they first did, the same [s].
        unasked: when the line last saw that they had not: a busy computer looks late [s].
        reached: numbers of the commands that reached the robot whole, with the instant [s].
        told: payloads that went into the line before the first Stop.
        whole: those that came out of it.
        stops: how often the host sent Stop.
        stopping: when it first did [s].
        blind: the longest time between two looks at the line [s].
        rollouts: how often the robot was armed.
    """

    sent: list[tuple[float, Said]] = field(default_factory=list)
    heard: list[tuple[float, Said]] = field(default_factory=list)
    commanded: dict[int, float] = field(default_factory=dict)
    asked: dict[int, float] = field(default_factory=dict)
    unasked: dict[int, float] = field(default_factory=dict)
    reached: list[tuple[float, int, float]] = field(default_factory=list)
    told: Counter[bytes] = field(default_factory=Counter)
    whole: Counter[bytes] = field(default_factory=Counter)
    stops: int = 0
    stopping: float = math.inf
    blind: float = 0.0
    rollouts: int = 0

    @property
    def spoilt(self) -> int:
        """Frames that did not come out of the line as they went in."""
        return sum((self.told - self.whole).values())


class Disturbance(Protocol):
    """What happens to bytes on their way."""

    def to_robot(self, data: bytes) -> bytes:
        """What reaches the robot."""

    def to_host(self, data: bytes) -> bytes:
        """What reaches the host."""


class Line:
    """Carries bytes between a host, which finds its end at `host_path`, and the robot whose port a file names.

    Args:
        host_path: for the host; a link to a pseudo-terminal, which a port that vanishes does not leave behind.
        port_file: names the robot's port, as soon as there is one.
    """

    def __init__(self, host_path: Path, port_file: Path) -> None:
        self.passed = Passed()
        self._host_path, self._port_file = host_path, port_file
        self._looking = self._looked = 0.0
        self._host = self._robot = -1
        self.begin_record()
        self.come_back()

    def begin_record(self) -> None:
        """Forget what passed so far."""
        self.passed = Passed()
        self._looking = time.monotonic()
        self._cutters = [Cutter() for _ in range(4)]

    def vanish(self) -> None:
        """Take the host's port away, as where its plug is pulled; the robot does not notice."""
        self._host_path.unlink()
        os.close(self._host)
        self._host = -1

    def come_back(self) -> None:
        """Have a port for the host, if there is none."""
        if self._host < 0:
            self._host, end = pty.openpty()
            tty.setraw(end)
            self._host_path.symlink_to(os.ttyname(end))
            os.close(end)
            os.set_blocking(self._host, False)

    def pump(self, seconds: float, faults: Disturbance) -> None:
        """Carry what comes, at most once each way, after a wait of at most `seconds`."""
        self._find_robot()
        self._looked, self._looking = self._looking, time.monotonic()
        self.passed.blind = max(self.passed.blind, self._looking - self._looked)
        ends = [end for end in (self._host, self._robot) if end >= 0]
        ready = select.select(ends, [], [], seconds)[0] if ends else []
        if self._robot in ready:
            self._carry_to_host(self._read_robot(), faults)
        if self._host in ready:
            self._carry_to_robot(self._read_host(), faults)

    def close(self) -> None:
        """Free both ends."""
        for end in (self._host, self._robot):
            if end >= 0:
                os.close(end)
        self._host_path.unlink(missing_ok=True)

    def _find_robot(self) -> None:
        if self._robot < 0:
            with suppress(OSError):
                self._robot = os.open(self._port_file.read_text(), os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)

    def _read_robot(self) -> bytes:
        with suppress(BlockingIOError, OSError):
            if data := os.read(self._robot, 4096):
                return data
        os.close(self._robot)  # it starts anew
        self._robot = -1
        return b""

    def _read_host(self) -> bytes:
        try:
            return os.read(self._host, 4096)
        except OSError:  # no host has it open
            time.sleep(_ABSENT)
            return b""

    def _carry_to_host(self, data: bytes, faults: Disturbance) -> None:
        now, before, after = time.monotonic(), self._cutters[0], self._cutters[1]
        told = before.feed(data)
        for payload in told:
            if said := said_in(payload):
                self._note(now, said)
        arrives = faults.to_host(data)
        whole = after.feed(arrives)
        self._count(told, whole)
        if self._host >= 0:
            with suppress(OSError):  # nobody reads it
                os.write(self._host, arrives)
        arrived = time.monotonic()
        self.passed.heard += [(arrived, said) for payload in whole if (said := said_in(payload))]

    def _note(self, now: float, said: Said) -> None:
        passed = self.passed
        before = passed.sent[-1][1] if passed.sent else None
        if said.is_armed and not said.period and not (before and before.is_armed and not before.period):
            passed.rollouts += 1
            passed.sent.clear()
            passed.heard.clear()
            passed.reached.clear()
            passed.asked.clear()
            passed.unasked.clear()
            passed.told.clear()
            passed.whole.clear()
            passed.stops, passed.stopping = 0, math.inf
        passed.sent.append((now, said))

    def _carry_to_robot(self, data: bytes, faults: Disturbance) -> None:
        now, before, after = time.monotonic(), self._cutters[2], self._cutters[3]
        told = before.feed(data)
        for payload in told:
            if (total := total_in(payload)) is not None:
                self.passed.commanded[_number(payload)] = total
                self.passed.asked.setdefault(_number(payload), now)
                self.passed.unasked.setdefault(_number(payload), self._looked)
        arrives = faults.to_robot(data)
        whole = after.feed(arrives)
        self._count(told, whole)
        for payload in whole:
            if (total := total_in(payload)) is not None:
                self.passed.reached.append((now, _number(payload), total))
        if self._robot >= 0:
            with suppress(OSError):
                os.write(self._robot, arrives)

    def _count(self, told: list[bytes], whole: list[bytes]) -> None:
        stops = sum(payload[0] == STOP for payload in told)
        if stops and not self.passed.stops:
            self.passed.stopping = time.monotonic()
        self.passed.stops += stops
        self.passed.whole.update(whole)
        if not self.passed.stops:
            self.passed.told.update(told)


def _number(payload: bytes) -> int:
    number = number_in(payload)
    assert number is not None
    return number
