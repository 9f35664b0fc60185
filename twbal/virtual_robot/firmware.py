"""The robot's side of the protocol: bytes and the time in, bytes out, over any plant. No port, no real clock."""

import math
from dataclasses import dataclass

from twbal.core.errors import ConfigError
from twbal.core.plant import Observation, Plant
from twbal.link.protocol import (
    VERSION,
    Arm,
    Clock,
    Command,
    Decoder,
    Fault,
    Hello,
    Message,
    PoseReport,
    Status,
    Stop,
    Telemetry,
    Welcome,
    to_wire,
)


@dataclass(frozen=True)
class Identity:
    """What a robot says of itself, and the rules by which it stops its own motors.

    Attributes:
        name: of the robot.
        torque_limit: greatest sum of the two wheel torques [N·m].
        tilt_limit: measured |tilt| beyond which it stops [rad].
        watchdog: time after the last valid command at which it stops, in real time [s].
        clock: lockstep, or real time.

    Raises:
        ConfigError: a limit is not positive and finite, so that nothing would ever stop the robot.
    """

    name: str
    torque_limit: float
    tilt_limit: float
    watchdog: float
    clock: Clock

    def __post_init__(self) -> None:
        for name in ("torque_limit", "tilt_limit", "watchdog"):
            if not 0 < getattr(self, name) < math.inf:
                raise ConfigError(f"{name} of a robot must be positive and finite; found {getattr(self, name)}.")


class Firmware:
    """Drives a plant as the host commands, and stops it by itself where it must.

    In lockstep each command advances the plant by one control period. In real time `advance` does so when a period is
    over, with the torque that was commanded last: a command that comes late in a period acts for all of it, where on a
    real robot it acts for what is left. The period in which the watchdog runs out is driven without torque. A robot
    that has stopped itself goes on measuring, so that the host sees why, and takes commands without following them.
    """

    def __init__(self, plant: Plant, identity: Identity) -> None:
        self._plant = plant
        self._identity = identity
        self._period_us = round(plant.control_period * 1e6)
        self._decoder = Decoder()
        self._greeted = False
        self._taken = 0  # number of the host's message acted on last
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
        answers = [answer for message in self._decoder.feed(data) for answer in self._take(message, now_us)]
        return b"".join(map(to_wire, answers))

    def advance(self, now_us: int) -> bytes:
        """Drive through the control periods that are over by `now_us` and return what is seen at their ends."""
        sent: list[Message] = []
        while (tick := self.next_tick_us) is not None and tick <= now_us:
            if self._status & Status.ARMED and tick - self._commanded_us > self._identity.watchdog * 1e6:
                self._trip(Status.WATCHDOG_STOPPED)
            sent += self._drive()
        return b"".join(map(to_wire, sent))

    def host_gone(self) -> None:
        """Switch off and wait for the next handshake."""
        self._disarm()
        self._greeted = False

    def _take(self, message: Message, now_us: int) -> list[Message]:
        if isinstance(message, Hello):
            self._disarm()
            self._greeted = message.version == VERSION
        elif not self._greeted:
            return [Fault(message.seq, "no handshake of this version yet; begin with Hello")]
        elif message.seq == self._taken:  # does not hold the watchdog off: a host that repeats itself hears nothing
            return [] if self.next_tick_us is not None else self._answer
        self._taken = message.seq
        self._answer = self._act(message, now_us)
        return self._answer

    def _act(self, message: Message, now_us: int) -> list[Message]:
        match message:
            case Hello():
                return [self._welcome()]
            case Arm(trial=trial):
                return self._arm(trial, now_us)
            case Command(torque=torque) if not math.isfinite(torque):
                return [Fault(message.seq, f"a torque of {torque} N·m is not a finite number")]
            case Command() if self._standing:
                return [Fault(message.seq, "the motors are off; begin with Arm")]
            case Command(torque=torque):
                return self._command(torque, now_us)
            case Stop():
                self._disarm()
                return [self._telemetry()]
            case _:
                return [Fault(message.seq, f"{type(message).__name__} is a robot's word, not a host's")]

    def _welcome(self) -> Welcome:
        me = self._identity
        return Welcome(self._taken, VERSION, self._period_us, me.torque_limit, me.clock, me.name)

    def _arm(self, trial: int, now_us: int) -> list[Message]:
        self._disarm()
        self._seen = self._plant.reset(trial)
        self._standing = False
        self._status = Status.ARMED
        self._time_us = now_us if self._identity.clock is Clock.REAL_TIME else 0
        self._commanded_us = now_us
        self._check_tilt()
        return self._report()

    def _command(self, torque: float, now_us: int) -> list[Message]:
        if self._status & Status.ARMED:
            self._torque = max(-self._identity.torque_limit, min(torque, self._identity.torque_limit))
            self._commanded_us = now_us
        return self._drive() if self._identity.clock is Clock.LOCKSTEP else []

    def _drive(self) -> list[Message]:
        """One control period."""
        self._seen = self._plant.step(self._torque)
        self._period += 1
        self._time_us += self._period_us
        self._check_tilt()
        return self._report()

    def _check_tilt(self) -> None:
        if self._status & Status.ARMED and not abs(self._seen.tilt) <= self._identity.tilt_limit:
            self._trip(Status.TILT_STOPPED)

    def _trip(self, reason: Status) -> None:
        self._status = reason
        self._torque = 0.0

    def _disarm(self) -> None:
        if not self._standing:
            self._plant.stop()
        self._standing = True
        self._status = Status(0)
        self._torque = 0.0
        self._period = 0
        self._time_us = self._commanded_us = 0
        self._seen = Observation(*(0.0,) * len(Observation._fields))

    def _report(self) -> list[Message]:
        """The telemetry, and before it the true pose where the plant knows it."""
        telemetry, pose = self._telemetry(), self._plant.pose()
        if pose is None:
            return [telemetry]
        return [PoseReport(telemetry.seq, telemetry.period, *pose), telemetry]

    def _telemetry(self) -> Telemetry:
        seen = self._seen
        return Telemetry(
            seq=self._taken,
            period=self._period % 2**16,
            time_us=self._time_us % 2**32,
            status=self._status,
            tilt=seen.tilt,
            tilt_rate=seen.tilt_rate,
            acceleration=seen.acceleration,
            wheel_left=seen.wheel_angle,
            wheel_right=seen.wheel_angle,
            rate_left=seen.wheel_rate,
            rate_right=seen.wheel_rate,
            yaw_rate=seen.yaw_rate,
        )
