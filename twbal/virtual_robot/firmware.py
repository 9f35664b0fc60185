"""The robot's side of the protocol: bytes and the time in, bytes out, over any plant. No port, no real clock."""

import math
from dataclasses import dataclass

from twbal.core.errors import ConfigError
from twbal.core.motor import Motor
from twbal.core.plant import Observation, Plant
from twbal.link.decoder import Decoder, to_wire
from twbal.link.message import Message
from twbal.link.protocol import (
    VERSION,
    Arm,
    Clock,
    Command,
    Drive,
    Fault,
    Follow,
    Hello,
    PoseReport,
    Sensors,
    Status,
    Stop,
    Telemetry,
    Welcome,
)
from twbal.link.version_1 import VERSION_1, downgraded, upgraded
from twbal.link.wheel_commands import WheelCommands, WheelLimits, torque_per_voltage

_MEASURED = Sensors.TILT | Sensors.TILT_RATE | Sensors.WHEEL_ANGLE | Sensors.WHEEL_RATE
_MEASURED |= Sensors.ACCELERATION | Sensors.YAW_RATE
_AT_REST = WheelCommands(0.0)


def measured_by(plant: Plant) -> Sensors:
    """What the sensors of a plant tell."""
    apart = Sensors.WHEEL_DIFFERENCE | Sensors.DIFFERENCE_RATE
    return _MEASURED | apart if plant.wheel_difference() else _MEASURED


@dataclass(frozen=True)
class Identity:
    """What a robot says of itself, and the rules by which it stops its own motors.

    Attributes:
        name: of the robot.
        torque_limit: greatest sum of the two wheel torques [N·m].
        tilt_limit: measured |tilt| beyond which it stops [rad].
        watchdog: time after the last valid command at which it stops, in real time [s].
        clock: lockstep, or real time.
        version: of the protocol that it speaks.
        motor: by which it turns voltages into torques; None: it takes no voltages.
        firmware: number of its build; 0: unknown.

    Raises:
        ConfigError: a limit is not positive and finite, so that nothing would ever stop the robot.
    """

    name: str
    torque_limit: float
    tilt_limit: float
    watchdog: float
    clock: Clock
    version: int = VERSION
    motor: Motor | None = None
    firmware: int = 0

    def __post_init__(self) -> None:
        if self.version not in (VERSION_1, VERSION):
            raise ConfigError(f"A robot speaks version {VERSION_1} or {VERSION} of the protocol; found {self.version}.")
        for name in ("torque_limit", "tilt_limit", "watchdog"):
            if not 0 < getattr(self, name) < math.inf:
                raise ConfigError(f"{name} of a robot must be positive and finite; found {getattr(self, name)}.")


class Firmware:
    """Drives a plant as the host commands, and stops it by itself where it must.

    In lockstep each command advances the plant by one control period. In real time the plant moves while the time
    passes, by the torque that was commanded last: a command that comes late in a period acts for what is left of it.
    What is measured at a period's end has thus little to wait for. A robot that has stopped itself goes on measuring,
    so that the host sees why, and takes commands without following them.
    """

    def __init__(self, plant: Plant, identity: Identity) -> None:
        self._plant = plant
        self._identity = identity
        self._limits = WheelLimits(identity.torque_limit, identity.torque_limit if plant.turns else 0.0)
        self._period_us = round(plant.control_period * 1e6)
        self._decoder = Decoder(identity.version)
        self._greeted = False
        self._taken = 0  # number of the host's message acted on last
        self._outdated = 0  # messages older than that, which were dropped
        self._answer: list[Message] = []  # to that message
        self._standing = True  # motors off, nothing measured
        self._disarm()

    @property
    def next_tick_us(self) -> int | None:
        """When `advance` has something to do next [µs]; None while it has not."""
        if self._standing or self._identity.clock is Clock.LOCKSTEP:
            return None
        return self._time_us + self._period_us

    def receive(self, data: bytes, now_us: int) -> bytes:
        """Act on the host's bytes, in whatever pieces they come, and return what to send.

        Args:
            data: what came.
            now_us: robot's clock; in lockstep it is not looked at [µs].
        """
        self._pass(now_us)
        heard = map(upgraded, self._decoder.feed(data))
        return self._sent([answer for message in heard for answer in self._take(message, now_us)])

    def advance(self, now_us: int) -> bytes:
        """Drive through the control periods that are over by `now_us` and return what is seen at their ends."""
        sent: list[Message] = []
        while (tick := self.next_tick_us) is not None and tick <= now_us:
            self._watch(tick)
            self._late += not self._is_fresh
            sent += self._drive()
        self._pass(now_us)
        return self._sent(sent)

    def host_gone(self) -> None:
        """Switch off and wait for the next handshake."""
        self._disarm()
        self._greeted = False

    def _sent(self, messages: list[Message]) -> bytes:
        speak = downgraded if self._identity.version == VERSION_1 else lambda message: message
        return b"".join(to_wire(speak(message)) for message in messages)

    def _take(self, message: Message, now_us: int) -> list[Message]:
        if isinstance(message, Hello):
            self._disarm()
            self._greeted = message.version == self._identity.version
        elif not self._greeted:
            return [Fault(message.seq, "no handshake of this version yet; begin with Hello")]
        elif message.seq == self._taken:  # does not hold the watchdog off: a host that repeats itself hears nothing
            return [] if self.next_tick_us is not None else self._answer
        elif (message.seq - self._taken) % 2**16 >= 2**15:  # late on its way, or a copy
            self._outdated += 1
            return []
        self._taken = message.seq
        self._answer = self._act(message, now_us)
        return self._answer

    def _act(self, message: Message, now_us: int) -> list[Message]:
        match message:
            case Hello():
                return [self._welcome()]
            case Arm(drive=Drive.ON_BOARD):
                return [Fault(message.seq, "there is no policy on board")]
            case Arm(drive=Drive.VOLTAGE) if self._identity.motor is None:
                return [Fault(message.seq, "the motors take no voltages")]
            case Arm():
                return self._arm(message, now_us)
            case Command(total=total, difference=difference) if not math.isfinite(total + difference):
                odd = difference if math.isfinite(total) else total
                return [Fault(message.seq, f"a torque of {odd} N·m is not a finite number")]
            case Command() if self._standing:
                return [Fault(message.seq, "the motors are off; begin with Arm")]
            case Command():
                return self._command(WheelCommands(message.total, message.difference), now_us)
            case Follow():
                return [Fault(message.seq, "there is no policy on board")]
            case Stop():
                self._disarm()
                return [self._telemetry()]
            case _:
                return [Fault(message.seq, f"{type(message).__name__} is a robot's word, not a host's")]

    def _welcome(self) -> Welcome:
        me = self._identity
        return Welcome(
            seq=self._taken,
            version=me.version,
            control_period_us=self._period_us,
            torque_limit=me.torque_limit,
            clock=me.clock,
            difference_limit=self._limits.difference,
            voltage_limit=me.motor.supply if me.motor else math.nan,
            sensors=measured_by(self._plant),
            firmware=me.firmware,
            name=me.name,
        )

    def _arm(self, order: Arm, now_us: int) -> list[Message]:
        self._disarm()
        self._seen = self._plant.reset(order.trial)
        self._standing = False
        self._status = Status.ARMED
        voltage = order.drive is Drive.VOLTAGE and self._identity.motor
        self._torque_per_unit = torque_per_voltage(voltage) if voltage else 1.0
        self._time_us = now_us if self._identity.clock is Clock.REAL_TIME else 0
        self._commanded_us, self._is_fresh = self._time_us, True
        self._check_sensors()
        return self._report()

    def _command(self, asked: WheelCommands, now_us: int) -> list[Message]:
        is_lockstep = self._identity.clock is Clock.LOCKSTEP
        if self._status & Status.ARMED:
            asked = asked.times(self._torque_per_unit)
            self._torques = self._limits.cut(asked)
            self._status = Status.ARMED if self._limits.allow(asked) else Status.ARMED | Status.LIMITED
            self._commanded_us, self._is_fresh = self._time_us if is_lockstep else now_us, True
        return self._drive() if is_lockstep else []

    def _drive(self) -> list[Message]:
        """One control period."""
        if self._plant.turns:
            self._plant.steer(self._torques.difference)
        self._seen = self._plant.step(self._torques.total)
        self._applied = self._torques.times(1.0 / self._torque_per_unit)
        self._period += 1
        self._time_us += self._period_us
        self._is_fresh = False
        self._check_sensors()
        return self._report()

    def _check_sensors(self) -> None:
        """Stop where the robot leans too far, or a sensor that it is balanced by says what is no number."""
        seen = self._seen
        if not self._status & Status.ARMED:
            return
        if not all(map(math.isfinite, (seen.tilt, seen.tilt_rate, seen.wheel_angle, seen.wheel_rate))):
            self._trip(Status.SENSOR_STOPPED)
        elif abs(seen.tilt) > self._identity.tilt_limit:
            self._trip(Status.TILT_STOPPED)

    def _pass(self, now_us: int) -> None:
        """Let the plant move up to now, but not beyond the control period, where it moves in real time."""
        if self.next_tick_us is not None:
            self._watch(min(now_us, self.next_tick_us))
            self._move(now_us)

    def _move(self, until_us: int) -> None:
        if self._plant.turns:
            self._plant.steer(self._torques.difference)
        passed = min(max(until_us - self._time_us, 0), self._period_us)
        self._plant.drive_until(passed * 1e-6, self._torques.total)

    def _watch(self, now_us: int) -> None:
        """Switch off at the time at which the watchdog has run out."""
        end_us = self._commanded_us + round(self._identity.watchdog * 1e6)
        if self._status & Status.ARMED and now_us > end_us:
            self._move(end_us)
            self._trip(Status.WATCHDOG_STOPPED)

    def _trip(self, reason: Status) -> None:
        self._status = reason
        self._torques = _AT_REST

    def _disarm(self) -> None:
        if not self._standing:
            self._plant.stop()
        self._standing = True
        self._status = Status(0)
        self._torques = self._applied = _AT_REST
        self._torque_per_unit = 1.0
        self._period = self._late = 0
        self._time_us = self._commanded_us = 0
        self._is_fresh = False
        self._seen = Observation(*(0.0,) * len(Observation._fields))

    def _report(self) -> list[Message]:
        """The telemetry, and before it the true pose where the plant knows it."""
        telemetry, pose = self._telemetry(), self._plant.pose()
        if pose is None:
            return [telemetry]
        return [PoseReport(telemetry.seq, telemetry.period, *pose), telemetry]

    def _telemetry(self) -> Telemetry:
        seen, apart = self._seen, None if self._standing else self._plant.wheel_difference()
        return Telemetry(
            seq=self._taken,
            period=self._period % 2**16,
            time_us=self._time_us % 2**32,
            status=self._status,
            tilt=seen.tilt,
            tilt_rate=seen.tilt_rate,
            acceleration=seen.acceleration,
            wheel_angle=seen.wheel_angle,
            wheel_rate=seen.wheel_rate,
            wheel_difference=apart.angle if apart else math.nan,
            difference_rate=apart.rate if apart else math.nan,
            yaw_rate=seen.yaw_rate,
            applied=self._applied.total,
            applied_difference=self._applied.difference,
            command_us=self._commanded_us % 2**32,
            late=self._late % 2**16,
            dropped=(self._decoder.bad_frames + self._outdated) % 2**16,
        )
