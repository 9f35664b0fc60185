"""What host and robot say to each other in version 2; bytes in, messages out, no port in sight.

`docs/protocol.md` is the specification. Every message begins with its type and a number. The host counts its messages;
the robot's messages carry the number of the host's message that it took last, so an answer names what it answers. A
message that comes twice acts once. The firmware's header and the specification's listing are generated from the classes
here (`scripts/protocol.py`). Signs are those of `twbal.core.plant`.
"""

from dataclasses import dataclass
from enum import IntEnum, IntFlag
from math import nan
from typing import Annotated, ClassVar

from twbal.link.message import F32, TEXT, U8, U16, U32, Message

VERSION = 2
"""Of the protocol."""

WATCHDOG = 0.1
"""Time after the last valid command at which a robot in real time switches its motors off [s]."""

ON_BOARD_WATCHDOG = 10.0
"""The same where the policy on board drives: so long it stands by itself [s]."""


class Clock(IntEnum):
    """What makes a robot's time advance."""

    LOCKSTEP = 0  # each command, by one control period
    REAL_TIME = 1  # nature; the robot streams telemetry once a control period


class Drive(IntEnum):
    """What drives the motors of an armed robot."""

    TORQUE = 0  # the host, by torques [N·m]
    VOLTAGE = 1  # the host, by voltages [V]
    ON_BOARD = 2  # the policy on board, which follows the host's reference


class Status(IntFlag):
    """State of the motors; without ARMED they are off."""

    ARMED = 1
    TILT_STOPPED = 2  # beyond its own tilt limit
    WATCHDOG_STOPPED = 4  # no valid command for too long
    SENSOR_STOPPED = 8  # a sensor that it balances by fell silent, or said what is no number
    ON_BOARD = 16  # the policy on board drives
    HOST_SILENT = 32  # no valid message of the host for 100 ms; the policy on board drives on, its reference at rest
    LIMITED = 64  # the last command was cut to the robot's limits


class Sensors(IntFlag):
    """What a robot measures; a value without its bit is absent, and NaN in the telemetry."""

    TILT = 1
    TILT_RATE = 2
    ACCELERATION = 4
    WHEEL_ANGLE = 8
    WHEEL_RATE = 16
    WHEEL_DIFFERENCE = 32
    DIFFERENCE_RATE = 64
    YAW_RATE = 128
    HEADING = 256
    BATTERY = 512


NEEDED = Sensors.TILT | Sensors.TILT_RATE | Sensors.WHEEL_ANGLE | Sensors.WHEEL_RATE
"""What a robot must measure to be driven."""


@dataclass(frozen=True)
class Hello(Message):
    """Host: are you there, and do we speak the same version? Switches the motors off."""

    version: Annotated[int, U16, "of the protocol that the host speaks"] = VERSION

    TYPE: ClassVar[int] = 0x01


@dataclass(frozen=True)
class Stop(Message):
    """Host: switch the motors off."""

    TYPE: ClassVar[int] = 0x04


@dataclass(frozen=True)
class Arm(Message):
    """Host: the robot stands at its start; switch the motors on, at zero torque."""

    trial: Annotated[int, U32, "number of the rollout; a simulated robot draws its start pose and noise from it"]
    drive: Annotated[Drive, U8, "what drives: 0 torques, 1 voltages, 2 the policy on board"] = Drive.TORQUE

    TYPE: ClassVar[int] = 0x05


@dataclass(frozen=True)
class Command(Message):
    """Host: what the wheels get from now on."""

    total: Annotated[float, F32, "N·m or V; right plus left, positive drives forward"]
    difference: Annotated[float, F32, "N·m or V; right minus left, positive turns to the left"] = 0.0

    TYPE: ClassVar[int] = 0x06


@dataclass(frozen=True)
class Follow(Message):
    """Host: the reference from now on, for the policy on board."""

    position: Annotated[float, F32, "m; along the robot's own way, from where it was armed"]
    speed: Annotated[float, F32, "m/s"]
    heading: Annotated[float, F32, "rad; from that at arming, positive to the left; NaN: do not control it"]
    yaw_rate: Annotated[float, F32, "rad/s"]
    gives_way: Annotated[int, U8, "not 0: it waits for a robot that cannot follow, and integrals do not grow"] = 0

    TYPE: ClassVar[int] = 0x07


@dataclass(frozen=True)
class Welcome(Message):
    """Robot: who I am. Of an unknown version only the version is read, the rest stays empty."""

    version: Annotated[int, U16, "of the protocol that the robot speaks"]
    control_period_us: Annotated[int, U32, "µs"] = 0
    torque_limit: Annotated[float, F32, "N·m; greatest sum of both wheels"] = 0.0
    clock: Annotated[Clock, U8, "0 lockstep, 1 real time"] = Clock.LOCKSTEP
    difference_limit: Annotated[float, F32, "N·m; greatest difference of the wheels; 0: it does not turn"] = 0.0
    voltage_limit: Annotated[float, F32, "V; greatest of a motor; NaN: it takes no voltages"] = nan
    sensors: Annotated[Sensors, U16, "what it measures, as bits"] = NEEDED
    policy: Annotated[int, U32, "first 4 bytes of the SHA-256 of the policy on board; 0: there is none"] = 0
    firmware: Annotated[int, U32, "changes with every build of the firmware; 0: unknown"] = 0
    name: Annotated[str, TEXT, "of the robot"] = ""

    TYPE: ClassVar[int] = 0x81


@dataclass(frozen=True)
class Fault(Message):
    """Robot: your message cannot be followed, and why."""

    text: Annotated[str, TEXT, "why"]

    TYPE: ClassVar[int] = 0x83


@dataclass(frozen=True)
class PoseReport(Message):
    """Robot: where it truly is at the instant of the telemetry that follows, as `twbal.core.plant.Pose` says.

    Only of robots that know it beyond their own sensors: simulated ones, or ones that cameras watch. Where the numbers
    `seq` and `period` are not those of the next telemetry, it belongs to one that was lost.
    """

    period: Annotated[int, U16, "of the telemetry that follows"]
    x: Annotated[float, F32, "m; forward, of the middle of the axle, from where it was armed"]
    y: Annotated[float, F32, "m; to the left"]
    heading: Annotated[float, F32, "rad; positive to the left"]
    tilt: Annotated[float, F32, "rad; of the body"]

    TYPE: ClassVar[int] = 0x84


@dataclass(frozen=True)
class Telemetry(Message):
    """Robot: what the sensors say at the beginning of a control period, and what was done in the one before."""

    period: Annotated[int, U16, "control periods since arming, modulo 2¹⁶"]
    time_us: Annotated[int, U32, "µs; robot's own clock, modulo 2³²"]
    status: Annotated[Status, U8, "state of the motors, as bits"]
    tilt: Annotated[float, F32, "rad"]
    tilt_rate: Annotated[float, F32, "rad/s"]
    acceleration: Annotated[float, F32, "m/s²; of the axle, forward, mean over the last control period"] = nan
    wheel_angle: Annotated[float, F32, "rad; mean of both wheels, relative to the body"] = nan
    wheel_rate: Annotated[float, F32, "rad/s; of that"] = nan
    wheel_difference: Annotated[float, F32, "rad; right wheel minus left wheel"] = nan
    difference_rate: Annotated[float, F32, "rad/s; of that"] = nan
    yaw_rate: Annotated[float, F32, "rad/s; about the vertical, positive to the left"] = nan
    heading: Annotated[float, F32, "rad; the robot's own estimate, from that at arming"] = nan
    battery: Annotated[float, F32, "V"] = nan
    applied: Annotated[float, F32, "unit of the commands; sum applied in the last period, after all limits"] = nan
    applied_difference: Annotated[float, F32, "the same of the difference"] = nan
    command_us: Annotated[int, U32, "µs; robot's clock when it took the last command, modulo 2³²"] = 0
    late: Annotated[int, U16, "control periods since arming without a new command, modulo 2¹⁶"] = 0
    dropped: Annotated[int, U16, "frames that the robot dropped since power-on, modulo 2¹⁶"] = 0

    TYPE: ClassVar[int] = 0x85


SHARED: tuple[type[Message], ...] = (Hello, Welcome, Stop, Fault, PoseReport)
"""Messages whose type and meaning are those of version 1 too; of Welcome only the first three fields are the same."""

OWN: tuple[type[Message], ...] = (Arm, Command, Follow, Telemetry)
"""Messages of this version alone."""
