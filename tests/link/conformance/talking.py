"""A host that says single words to a robot, and hears what it answers: over a port, or in memory."""

import time
from contextlib import contextmanager

from pendulum import Pendulum

from twbal.link.decoder import Decoder, to_wire
from twbal.link.protocol import Arm, Command, Hello, PoseReport, Stop, Telemetry
from twbal.link.transport import SerialTransport
from twbal.virtual_robot.firmware import Firmware, Identity
from twbal.virtual_robot.process import VirtualRobotProcess, virtual_robot_command

_PATIENCE = 20.0  # for an answer that must come [s]
_SILENCE = 0.3  # in which nothing must come [s]
_START = 240.0  # a first start compiles, which takes a minute on a busy machine [s]


class Host:
    """Numbers its words; subclasses carry bytes and time.

    Attributes:
        heard: all that came in the current test, without true poses.
    """

    def __init__(self):
        self.heard, self.number, self._decoder = [], 100, Decoder(2)

    def write(self, data):
        raise NotImplementedError

    def pass_time(self, seconds):
        """Take what comes within a time, until something has come."""
        raise NotImplementedError

    def take(self, data):
        self.heard += [m for m in self._decoder.feed(data) if not isinstance(m, PoseReport)]

    def next(self):
        self.number = (self.number + 1) % 2**16
        return self.number

    def say(self, kind, *fields, seq=None):
        """Send a word, and return its number."""
        number = self.next() if seq is None else seq
        self.write(to_wire(kind(number, *fields)))
        return number

    def ask(self, kind, *fields, seq=None, wanted=lambda message: True):
        """Send a word, and return the first answer to it that is as wanted."""
        begin = len(self.heard)
        number = self.say(kind, *fields, seq=seq)
        return self.wait(lambda m: m.seq == number and wanted(m), begin)

    def wait(self, wanted, begin=None):
        """The first message, from number `begin` on, that is as wanted."""
        begin = len(self.heard) if begin is None else begin
        deadline = time.monotonic() + _PATIENCE
        while time.monotonic() < deadline:
            for message in self.heard[begin:]:
                if wanted(message):
                    return message
            self.pass_time(0.02)
        raise AssertionError(f"what was waited for did not come; heard {self.heard[begin:][-3:]}")

    def silence(self):
        """What comes where nothing must."""
        begin, deadline = len(self.heard), time.monotonic() + _SILENCE
        while time.monotonic() < deadline:
            self.pass_time(0.05)
        return self.heard[begin:]

    def greet(self):
        """From any state to *off*; what came before is forgotten."""
        welcome = self.ask(Hello, 2)
        self.heard.clear()
        return welcome

    def arm(self, trial=0):
        """To *armed*."""
        self.greet()
        return self.ask(Arm, trial)

    def command(self, total, difference=0.0, seq=None):
        return self.ask(Command, total, difference, seq=seq, wanted=lambda m: isinstance(m, Telemetry))

    def stop(self):
        return self.ask(Stop, wanted=lambda m: isinstance(m, Telemetry) and not m.status & 1)


class PortHost(Host):
    """Over the port of a robot's process."""

    def __init__(self, port):
        super().__init__()
        self._line = SerialTransport(port, 921600)

    def write(self, data):
        self._line.write(data)

    def pass_time(self, seconds):
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            data = self._line.read()  # waits 20 ms at most
            self.take(data)
            if data:
                return

    def close(self):
        self._line.close()


class MemoryHost(Host):
    """To the firmware in Python, in this process; time passes as it is asked to."""

    def __init__(self, clock):
        super().__init__()
        me = Identity("pendulum", torque_limit=20.0, tilt_limit=1.0, watchdog=0.1, clock=clock)
        self._firmware, self._now = Firmware(Pendulum(), me), 1_000_000

    def write(self, data):
        self.take(self._firmware.receive(data, self._now))

    def pass_time(self, seconds):
        for _ in range(round(seconds * 1000)):
            self._now += 1000
            self.take(self._firmware.advance(self._now))

    def silence(self):
        begin = len(self.heard)
        self.pass_time(_SILENCE)
        return self.heard[begin:]

    def close(self):
        self._firmware.host_gone()


@contextmanager
def robot_of(kind, clock, program):
    """Opens hosts of a robot that lives as long as the body.

    Args:
        kind: "memory", "mujoco" or "firmware".
        clock: of the robot.
        program: makes the firmware's program.
    """
    if kind == "memory":
        yield lambda: MemoryHost(clock)
        return
    words = [f"clock={clock.name.lower()}", "faults=none", "robot=paper"]
    if kind == "firmware":
        words.append(f"firmware={program()}")
    process = VirtualRobotProcess(virtual_robot_command(words), _START)
    try:
        yield lambda: PortHost(process.port)
    finally:
        process.close()
