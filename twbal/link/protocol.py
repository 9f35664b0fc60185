"""What host and robot say to each other; bytes in, messages out, no port in sight. `docs/link.md` is the specification.

Every message begins with its type and a number. The host counts its messages; the robot's messages carry the number of
the host's message that it took last, so an answer names what it answers. A message that comes twice acts once.

Measured values travel as float32: it is what a microcontroller computes with, and its resolution (1e-8 rad at a tilt of
10°, 1e-5 rad at 100 rad of wheel angle) is far below any sensor's noise.
"""

import struct
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import ClassVar, Self

from twbal.core.errors import printable
from twbal.link.frame import Splitter, unwrap, wrap

VERSION = 1
"""Of the protocol; both sides must speak the same."""

MAX_TEXT = 200
"""Longest text in a message [bytes of UTF-8]."""


class Clock(IntEnum):
    """What makes a robot's time advance."""

    LOCKSTEP = 0  # each command, by one control period
    REAL_TIME = 1  # nature; the robot streams telemetry once a control period


class Status(IntFlag):
    """State of the motors; without ARMED they are off."""

    ARMED = 1
    TILT_STOPPED = 2
    WATCHDOG_STOPPED = 4


@dataclass(frozen=True)
class Message:
    """A message: its type, then its fields in order.

    Attributes:
        seq: number of the message.
    """

    seq: int

    TYPE: ClassVar[int]
    LAYOUT: ClassVar[struct.Struct]

    def encode(self) -> bytes:
        """The payload of a frame."""
        return self.LAYOUT.pack(self.TYPE, *vars(self).values())

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """The message in a payload.

        Raises:
            struct.error: the length is wrong.
            ValueError: a field cannot be read.
        """
        return cls(*cls.LAYOUT.unpack(payload)[1:])


class TextMessage(Message):
    """A message whose last field is a text, which ends with the payload."""

    def encode(self) -> bytes:
        """The payload of a frame."""
        *fixed, text = vars(self).values()
        return self.LAYOUT.pack(self.TYPE, *fixed) + text_bytes(text)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """The message in a payload; see `Message.decode`."""
        text = printable(payload[cls.LAYOUT.size :].decode())
        fields = (*cls.LAYOUT.unpack_from(payload)[1:], text)
        return cls(*fields)


@dataclass(frozen=True)
class Hello(Message):
    """Host: are you there, and do we speak the same version? Disarms."""

    version: int = VERSION

    TYPE: ClassVar[int] = 0x01
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<BHH")


@dataclass(frozen=True)
class Welcome(TextMessage):
    """Robot: who I am. Of another version than ours only the version is read, the rest stays empty.

    Attributes:
        control_period_us: [µs].
        torque_limit: greatest sum of the two wheel torques [N·m].
        clock: what makes its time advance.
        name: of the robot.
    """

    version: int
    control_period_us: int = 0
    torque_limit: float = 0.0
    clock: Clock = Clock.LOCKSTEP
    name: str = ""

    TYPE: ClassVar[int] = 0x81
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<BHHIfB")

    def __post_init__(self) -> None:
        object.__setattr__(self, "clock", Clock(self.clock))

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """The message in a payload; see `Message.decode`."""
        _, seq, version = Hello.LAYOUT.unpack_from(payload)
        return super().decode(payload) if version == VERSION else cls(seq, version)


@dataclass(frozen=True)
class Arm(Message):
    """Host: the robot stands at its start; switch the motors on, at zero torque.

    Attributes:
        trial: number of the rollout. A virtual robot draws its start pose and its noise from it and its own seed; to a
            real one it is a label.
    """

    trial: int

    TYPE: ClassVar[int] = 0x02
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<BHI")


@dataclass(frozen=True)
class Command(Message):
    """Host: the torque from now on.

    Attributes:
        torque: sum of the two wheels' [N·m], positive drives them forward.
    """

    torque: float

    TYPE: ClassVar[int] = 0x03
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<BHf")


@dataclass(frozen=True)
class Stop(Message):
    """Host: switch the motors off."""

    TYPE: ClassVar[int] = 0x04
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<BH")


@dataclass(frozen=True)
class Telemetry(Message):
    """Robot: what the sensors say at the beginning of a control period; signs as in `twbal.core.plant`.

    Attributes:
        period: control periods since arming, modulo 2¹⁶.
        time_us: robot's own clock, modulo 2³² [µs].
        status: state of the motors.
        tilt: [rad].
        tilt_rate: [rad/s].
        acceleration: platform's, forward, mean over the last control period [m/s²].
        wheel_left, wheel_right: relative to the body [rad].
        rate_left, rate_right: of the wheel angles [rad/s].
        yaw_rate: [rad/s].
    """

    period: int
    time_us: int
    status: Status
    tilt: float
    tilt_rate: float
    acceleration: float
    wheel_left: float
    wheel_right: float
    rate_left: float
    rate_right: float
    yaw_rate: float

    TYPE: ClassVar[int] = 0x82
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<BHHIB8f")

    def __post_init__(self) -> None:
        object.__setattr__(self, "status", Status(self.status))


@dataclass(frozen=True)
class Fault(TextMessage):
    """Robot: your message cannot be followed, and why."""

    text: str

    TYPE: ClassVar[int] = 0x83
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<BH")


@dataclass(frozen=True)
class PoseReport(Message):
    """Robot: where it truly is at the instant of the telemetry that follows, as `twbal.core.plant.Pose` says.

    Only of robots that know it beyond their own sensors: simulated ones, or ones that cameras watch. Where the numbers
    `seq` and `period` are not those of the next telemetry, it belongs to one that was lost.

    Attributes:
        period: of the telemetry that follows.
        x, y: [m].
        heading: [rad].
        tilt: [rad].
    """

    period: int
    x: float
    y: float
    heading: float
    tilt: float

    TYPE: ClassVar[int] = 0x84
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<BHH4f")


KINDS: dict[int, type[Message]] = {
    kind.TYPE: kind for kind in (Hello, Welcome, Arm, Command, Stop, Telemetry, Fault, PoseReport)
}


def text_bytes(text: str) -> bytes:
    """`text` in UTF-8, cut between characters where it is too long."""
    return text.encode()[:MAX_TEXT].decode(errors="ignore").encode()


def to_wire(message: Message) -> bytes:
    """The frame of a message."""
    return wrap(message.encode())


class Decoder:
    """Turns bytes into messages; what is not a message is counted and dropped, never an error.

    Attributes:
        bad_frames: frames dropped so far: a wrong CRC, an unknown type, a wrong length.
        unreadable: what was wrong with the last frame whose CRC is right and which is no message all the same; empty
            where there was none. Noise makes no such frame; other firmware does.
    """

    def __init__(self) -> None:
        self.unreadable = ""
        self._splitter = Splitter()
        self._undecodable = 0

    @property
    def bad_frames(self) -> int:
        """Frames dropped so far."""
        return self._undecodable + self._splitter.overlong

    def feed(self, data: bytes) -> list[Message]:
        """The messages that `data` completes, in order; `data` may end anywhere."""
        messages = [self._decode(run) for run in self._splitter.feed(data)]
        return [m for m in messages if m is not None]

    def _decode(self, run: bytes) -> Message | None:
        payload = unwrap(run)
        kind = KINDS.get(payload[0]) if payload else None
        if payload and kind is None:
            self.unreadable = f"a message of the unknown type 0x{payload[0]:02x}"
        if payload and kind is not None:
            try:
                return kind.decode(payload)
            except (struct.error, ValueError) as error:  # wrong length; unknown clock, or text that is not UTF-8
                self.unreadable = f"a {kind.__name__} of {len(payload)} bytes ({error})"
        self._undecodable += 1
        return None
