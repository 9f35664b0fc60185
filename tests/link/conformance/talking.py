"""A host that says single words to a robot, and hears what it answers: over a port, or in memory."""

import struct
import time
from contextlib import suppress

from pendulum import Pendulum

from twbal.link.decoder import Decoder, to_wire
from twbal.link.protocol import Arm, Clock, Command, Drive, Fault, Hello, PoseReport, Stop, Telemetry
from twbal.link.transport import SerialTransport
from twbal.virtual_robot.firmware import Firmware, Identity

_PATIENCE = 20.0  # for an answer that must come [s]
_BOOT = 0.5  # after which Hello is said again: some boards start when their port opens [s]
_SILENCE = 0.3  # in which nothing must come [s]


class Host:
    """Numbers its words; subclasses carry bytes and time.

    Attributes:
        heard: all that came in the current test, without true poses.
        welcome: what the robot says of itself; there is one after `greet`.
        is_ours: whether the robot is one of this repository, whose clock runs in whole periods.
        is_simulated: whether it falls when it is driven so, and begins a trial alike each time.
    """

    is_ours = is_simulated = True

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

    def ask(self, kind, *fields, seq=None, wanted=lambda message: True, patience=_PATIENCE):
        """Send a word, and return the first answer to it that is as wanted."""
        begin = len(self.heard)
        number = self.say(kind, *fields, seq=seq)
        return self.wait(lambda m: m.seq == number and wanted(m), begin, patience)

    def wait(self, wanted, begin=None, patience=_PATIENCE):
        """The first message, from number `begin` on, that is as wanted."""
        begin = len(self.heard) if begin is None else begin
        deadline = time.monotonic() + patience
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
        self.welcome = self.ask(Hello, 2)
        self.heard.clear()
        return self.welcome

    @property
    def is_lockstep(self):
        return self.welcome.clock is Clock.LOCKSTEP

    def arm(self, trial=0, drive=Drive.TORQUE):
        """To *armed*."""
        self.greet()
        return self.ask(Arm, trial, drive)

    def torque(self, share):
        """A share of the robot's torque limit, as it travels [N·m]."""
        return as_float32(share * self.welcome.torque_limit)

    def command(self, total, difference=0.0, seq=None):
        """The first telemetry that knows of a command."""
        return self.ask(Command, total, difference, seq=seq, wanted=lambda m: isinstance(m, Telemetry))

    def held(self, total, difference=0.0):
        """The telemetry of a period that a command had for itself from its beginning on."""
        first = self.command(total, difference)
        if self.is_lockstep:
            return first
        return self.wait(lambda m: isinstance(m, Telemetry) and m.period == first.period + 1, self.heard.index(first))

    def refused(self, kind, *fields, seq=None):
        """The Fault that answers a word; telemetry that streams may come before it."""
        answer = self.ask(kind, *fields, seq=seq, wanted=lambda m: self.is_lockstep or isinstance(m, Fault))
        assert isinstance(answer, Fault)
        return answer

    def since(self, before):
        """Numbers of all that came from a message on; in real time, where telemetry streams, each of them once."""
        numbers = [m.seq for m in self.heard[self.heard.index(before) :]]
        return numbers if self.is_lockstep else list(dict.fromkeys(numbers))

    def follows(self, after, before, periods=1):
        """Whether so many periods lie between two telemetries; in real time they go by whatever the host says."""
        passed = (after.period - before.period) % 2**16
        return passed == periods if self.is_lockstep else passed > 0

    def stop(self):
        return self.ask(Stop, wanted=lambda m: isinstance(m, Telemetry) and not m.status & 1)


def as_float32(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


class PortHost(Host):
    """Over the port of a robot's process."""

    def __init__(self, port, is_ours=True):
        super().__init__()
        self._line, self.is_ours = SerialTransport(port, 921600), is_ours

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


class StandingHost(PortHost):
    """Over a port that stays open from one test to the next, as some boards start anew when it is opened."""

    is_simulated = False

    def __init__(self, port):
        super().__init__(port, is_ours=False)
        self.meet()

    def meet(self):
        """Say Hello until the robot, which may just start, answers."""
        for _ in range(round(_PATIENCE / _BOOT)):
            with suppress(AssertionError):
                return self.ask(Hello, 2, patience=_BOOT)
        raise AssertionError("no robot answers Hello on this port")

    def close(self):
        self.say(Stop)

    def leave(self):
        self.close()
        super().close()


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
