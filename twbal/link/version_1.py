"""The messages of version 1, and what each is in version 2: both ends know version 2 only, and translate at the line.

Hello, Stop, Fault and PoseReport are the same in both versions; what changed has a type of its own in version 2.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from twbal.link.message import F32, TEXT, U8, U16, U32, Message
from twbal.link.protocol import Arm, Clock, Command, Sensors, Status, Telemetry, Welcome

VERSION_1 = 1
_SENSORS = ~(Sensors.HEADING | Sensors.BATTERY)  # of version 1, which cannot say that one is absent
_STATUS = Status.ARMED | Status.TILT_STOPPED | Status.WATCHDOG_STOPPED


@dataclass(frozen=True)
class Arm1(Message):
    """Host: switch the motors on, at zero torque."""

    trial: Annotated[int, U32, "number of the rollout"]

    TYPE: ClassVar[int] = 0x02


@dataclass(frozen=True)
class Command1(Message):
    """Host: the torque from now on."""

    torque: Annotated[float, F32, "N·m; sum of both wheels"]

    TYPE: ClassVar[int] = 0x03


@dataclass(frozen=True)
class Welcome1(Message):
    """Robot: who I am."""

    version: Annotated[int, U16, "of the protocol that the robot speaks"]
    control_period_us: Annotated[int, U32, "µs"] = 0
    torque_limit: Annotated[float, F32, "N·m; greatest sum of both wheels"] = 0.0
    clock: Annotated[Clock, U8, "0 lockstep, 1 real time"] = Clock.LOCKSTEP
    name: Annotated[str, TEXT, "of the robot"] = ""

    TYPE: ClassVar[int] = 0x81


@dataclass(frozen=True)
class Telemetry1(Message):
    """Robot: what the sensors say at the beginning of a control period."""

    period: Annotated[int, U16, "control periods since arming, modulo 2¹⁶"]
    time_us: Annotated[int, U32, "µs; robot's own clock, modulo 2³²"]
    status: Annotated[Status, U8, "1 armed, 2 tilt-stopped, 4 watchdog-stopped"]
    tilt: Annotated[float, F32, "rad"]
    tilt_rate: Annotated[float, F32, "rad/s"]
    acceleration: Annotated[float, F32, "m/s²"]
    wheel_left: Annotated[float, F32, "rad; relative to the body"]
    wheel_right: Annotated[float, F32, "rad"]
    rate_left: Annotated[float, F32, "rad/s"]
    rate_right: Annotated[float, F32, "rad/s"]
    yaw_rate: Annotated[float, F32, "rad/s"]

    TYPE: ClassVar[int] = 0x82


OWN_1: tuple[type[Message], ...] = (Arm1, Command1, Telemetry1)
"""Messages of version 1 alone."""


def upgraded(message: Message) -> Message:
    """What a message of version 1 is in version 2; others stay as they are."""
    match message:
        case Arm1():
            return Arm(message.seq, message.trial)
        case Command1():
            return Command(message.seq, message.torque)
        case Welcome1():
            m = message
            limits = (m.control_period_us, m.torque_limit, m.clock)
            return Welcome(m.seq, m.version, *limits, sensors=_SENSORS, name=m.name)
        case Telemetry1():
            return _upgraded_telemetry(message)
        case _:
            return message


def downgraded(message: Message) -> Message:
    """What a message of version 2 is in version 1, as far as that can say it; others stay as they are."""
    match message:
        case Arm():
            return Arm1(message.seq, message.trial)
        case Command():
            return Command1(message.seq, message.total)
        case Welcome():
            m = message
            return Welcome1(m.seq, m.version, m.control_period_us, m.torque_limit, m.clock, m.name)
        case Telemetry():
            return _downgraded_telemetry(message)
        case _:
            return message


def _upgraded_telemetry(m: Telemetry1) -> Telemetry:
    return Telemetry(
        seq=m.seq,
        period=m.period,
        time_us=m.time_us,
        status=m.status,
        tilt=m.tilt,
        tilt_rate=m.tilt_rate,
        acceleration=m.acceleration,
        wheel_angle=(m.wheel_left + m.wheel_right) / 2,
        wheel_rate=(m.rate_left + m.rate_right) / 2,
        wheel_difference=m.wheel_right - m.wheel_left,
        difference_rate=m.rate_right - m.rate_left,
        yaw_rate=m.yaw_rate,
    )


def _downgraded_telemetry(m: Telemetry) -> Telemetry1:
    """Both wheels say their mean, as a robot with one encoder does: a half of the difference would cost resolution."""
    tilted = Status.TILT_STOPPED if m.status & Status.SENSOR_STOPPED else Status(0)
    measured = (m.acceleration, m.wheel_angle, m.wheel_angle, m.wheel_rate, m.wheel_rate, m.yaw_rate)
    return Telemetry1(m.seq, m.period, m.time_us, m.status & _STATUS | tilted, m.tilt, m.tilt_rate, *measured)
