"""The plant behind a link: a real robot, or a virtual one; from this side there is no difference."""

import math
from collections.abc import Callable
from contextlib import suppress
from typing import Self

from twbal.core.episode import Event
from twbal.core.errors import ConfigError, DataError, LinkError, LinkLostError, ProtocolError
from twbal.core.plant import Observation, Plant, Pose
from twbal.link.exchange import Exchange
from twbal.link.protocol import (
    VERSION,
    Arm,
    Clock,
    Command,
    Hello,
    Message,
    Status,
    Stop,
    Telemetry,
    Welcome,
)
from twbal.link.ranges import MAX_CLOCK_STEP_US, MAX_TRIAL, check_timeouts, odd_announcement, odd_values
from twbal.link.transport import SerialTransport, Transport

_STOPS = 3  # how often Stop is sent to a robot that does not say that its motors are off
_FLOAT32_SLACK = 1 + 1e-6  # the announced limit went through float32


class SerialPlant(Plant):
    """A robot on a line: shakes hands, arms it for each rollout, and drives it.

    Attributes:
        control_period: as the robot announced it [s].
        robot_name: as announced.
        torque_limit: as announced; commands are clipped to it [N·m].
        clock: lockstep, or real time.
        missed_periods: control periods of the current rollout that passed without a command in time.
    """

    def __init__(
        self,
        transport: Transport,
        connect_timeout: float,
        arm_timeout: float,
        timeout: float,
        confirm_placed: Callable[[int], None] | None = None,
    ) -> None:
        """Shake hands with the robot; the transport is closed where that fails.

        Args:
            transport: line to the robot; closed with this plant.
            connect_timeout: how long the robot may take to say who it is; some boot when the port opens [s].
            arm_timeout: how long it may take to arm [s].
            timeout: silence in a rollout after which the link is lost [s].
            confirm_placed: called with the trial's number before each arming; returns when the robot stands at its
                start. None: the robot places itself.

        Raises:
            ProtocolError: it speaks another version, or announces what cannot be.
            LinkError: it does not answer.
            ConfigError: a time is not positive, or without end.
        """
        self._line, self._port = Exchange(transport), transport.name
        self._connect_timeout, self._arm_timeout, self._timeout = connect_timeout, arm_timeout, timeout
        self._confirm_placed = confirm_placed
        self._armed = self._lost = self._counter_stands = False
        self._events: list[Event] = []
        self._pose: Pose | None = None
        self._elapsed_us = 0  # on the robot's clock, in the current rollout [µs]
        self.missed_periods = 0
        try:
            check_timeouts(connect_timeout=connect_timeout, arm_timeout=arm_timeout, timeout=timeout)
            self._shake_hands()
        except BaseException:
            transport.close()
            raise

    @classmethod
    def open(
        cls,
        port: str,
        baud_rate: int,
        connect_timeout: float,
        arm_timeout: float,
        timeout: float,
        confirm_placed: Callable[[int], None] | None = None,
    ) -> Self:
        """The plant behind a serial port or URL; see `SerialTransport` and the constructor."""
        return cls(SerialTransport(port, baud_rate), connect_timeout, arm_timeout, timeout, confirm_placed)

    @property
    def events(self) -> tuple[Event, ...]:
        """What happened on the line in the current rollout: missed periods, clipped commands."""
        return tuple(self._events)

    @property
    def bad_frames(self) -> int:
        """Frames that arrived damaged since the plant was opened."""
        return self._line.bad_frames

    def reset(self, trial: int) -> Observation:
        """Have the robot placed, arm it and return its first observation; see `Plant.reset`.

        Raises:
            LinkError: it does not answer, or does not arm.
            LinkLostError: it measures what cannot be.
            ConfigError: the number does not fit into a message.
        """
        if not 0 <= trial <= MAX_TRIAL:
            raise ConfigError(f"The number of a trial must be 0 to {MAX_TRIAL}; found {trial}.")
        self.stop()
        if self._lost:
            self._shake_hands()
        if self._confirm_placed is not None:
            self._confirm_placed(trial)
        self._events.clear()
        self._elapsed_us, self.missed_periods, self._counter_stands = 0, 0, False
        self._armed = True  # as far as can be known: from here on the way out must disarm
        self._last = self._telemetry(Arm(self._line.next_number(), trial), self._arm_timeout)
        if not self._last.status & Status.ARMED:
            raise LinkError(
                f"The robot {self.robot_name} does not arm: {_why_stopped(self._last)}. Place it at its start."
            )
        return self._observation(self._last)

    def step(self, command: float) -> Observation:
        """Command a torque and return the next telemetry; see `Plant.step`.

        On a robot in real time the next telemetry is the newest one that knows of this command. Where the host was too
        late for a control period, the robot has held the command before; such periods are counted and noted in
        `events`.

        Raises:
            LinkLostError: the robot fell silent, has switched its motors off, measures what cannot be, or its clock
                does not run forward.
            DataError: the command is not a finite number.
        """
        if not math.isfinite(command):
            raise DataError(f"The command {command} N·m is not a finite number; it was not sent.")
        if not self._armed or self._lost or not self._last.status & Status.ARMED:
            raise LinkLostError(f"The robot {self.robot_name} is not armed: {self._why_not_driven()}. Reset it first.")
        before = self._last
        try:
            self._last = self._telemetry(Command(self._line.next_number(), self._clip(command)), self._timeout)
        except LinkError as error:
            self._lost = True
            raise LinkLostError(str(error)) from error
        self._count_missed((self._last.period - before.period) % 2**16 - 1)
        if not self._last.status & (Status.ARMED | Status.TILT_STOPPED):  # the command may not have acted
            raise LinkLostError(f"The robot {self.robot_name} stopped itself: {_why_stopped(self._last)}.")
        self._follow_clock(before, self._last)
        return self._observation(self._last)

    def pose(self) -> Pose | None:
        """What the robot said of its true pose with the last observation; None where it said nothing."""
        return self._pose

    def stop(self) -> None:
        """Switch the motors off and wait until the robot says that they are.

        Raises:
            LinkLostError: it does not say so. Its own watchdog is then all that is left.
        """
        if not self._armed:
            return
        try:
            self._switch_off()
        except LinkError as error:
            self._armed, self._lost = False, True
            raise LinkLostError(
                f"The robot {self.robot_name} does not confirm that its motors are off, and THEY MAY STILL BE ON: "
                f"switch it off by hand. ({error})"
            ) from error
        self._armed = False  # not before: where Ctrl-C cuts this short, the next call sends the stop again

    def close(self) -> None:
        """Switch the motors off and close the port; raises as `stop`."""
        try:
            try:
                self.stop()
            except KeyboardInterrupt:
                self.stop()
                raise
        finally:
            self._line.transport.close()

    def _switch_off(self) -> None:
        """Send Stop until the answer lacks the armed bit.

        Between two of them a Hello stops the motors, too, and makes a robot obey that has started anew.
        """
        patience = self._timeout / _STOPS
        for left in reversed(range(_STOPS)):
            try:
                self._line.ask(Stop(self._line.next_number()), patience, until=_says_off)
                return
            except LinkError:
                if not left:
                    raise
            with suppress(LinkError):
                self._line.ask(Hello(self._line.next_number()), patience)

    def _shake_hands(self) -> None:
        welcome = self._line.ask(Hello(self._line.next_number()), self._connect_timeout)
        if not isinstance(welcome, Welcome):
            raise ProtocolError(f"The robot on {self._port} answers Hello with {welcome}; expected Welcome.")
        if welcome.version != VERSION:
            raise ProtocolError(
                f"The robot on {self._port} speaks version {welcome.version} of the link protocol, this "
                f"twbal version {VERSION}. Update the older of the two."
            )
        if odd := odd_announcement(welcome):
            raise ProtocolError(f"The robot on {self._port} announces what cannot be: {odd}.")
        self.control_period = welcome.control_period_us * 1e-6
        self.robot_name, self.torque_limit, self.clock = welcome.name, welcome.torque_limit, Clock(welcome.clock)
        self._lost = False

    def _telemetry(self, message: Message, timeout: float) -> Telemetry:
        """Send `message` and return the telemetry that answers it."""
        answer = self._line.ask(message, timeout)
        if not isinstance(answer, Telemetry):
            raise ProtocolError(f"The robot on {self._port} answers {message} with {answer}; expected Telemetry.")
        return answer

    def _clip(self, command: float) -> float:
        if abs(command) > self.torque_limit * _FLOAT32_SLACK:
            self._note(f"command of {command:.3g} N·m clipped to the robot's limit of {self.torque_limit:.3g} N·m")
        return min(max(command, -self.torque_limit), self.torque_limit)

    def _follow_clock(self, before: Telemetry, now: Telemetry) -> None:
        advance = (now.time_us - before.time_us) % 2**32
        if not 0 < advance <= MAX_CLOCK_STEP_US:
            raise LinkLostError(
                f"The clock of the robot {self.robot_name} does not run forward: it says {before.time_us} µs, and then "
                f"{now.time_us} µs; expected at most {MAX_CLOCK_STEP_US * 1e-6:g} s more."
            )
        self._elapsed_us += advance

    def _count_missed(self, periods: int) -> None:
        if 0 <= periods < 2**15:
            self.missed_periods += periods
            if periods:
                self._note(f"{periods} control periods passed without a command in time")
        elif not self._counter_stands:
            self._counter_stands = True
            self._note("the robot's count of its control periods does not run forward, so missed ones are not noticed")

    def _note(self, text: str) -> None:
        self._events.append(Event(self._elapsed_us * 1e-6, text))

    def _observation(self, seen: Telemetry) -> Observation:
        if odd := odd_values(seen):
            raise LinkLostError(f"The robot {self.robot_name} sends {odd}. Is that sensor connected?")
        self._pose = self._true_pose()
        return Observation(
            time=self._elapsed_us * 1e-6,
            tilt=seen.tilt,
            tilt_rate=seen.tilt_rate,
            acceleration=seen.acceleration,
            wheel_angle=(seen.wheel_left + seen.wheel_right) / 2,
            wheel_rate=(seen.rate_left + seen.rate_right) / 2,
            yaw_rate=seen.yaw_rate,
        )

    def _true_pose(self) -> Pose | None:
        said = self._line.pose
        if said is None:
            return None
        if odd := odd_values(said):
            raise LinkLostError(f"The robot {self.robot_name} sends a pose with {odd}. What does it take it from?")
        return Pose(said.x, said.y, said.heading, said.tilt)

    def _why_not_driven(self) -> str:
        if self._lost:
            return "the link was lost"
        return _why_stopped(self._last) if self._armed else "it was stopped, or never reset"


def _says_off(answer: Message) -> bool:
    return isinstance(answer, Telemetry) and not answer.status & Status.ARMED


def _why_stopped(seen: Telemetry) -> str:
    if seen.status & Status.TILT_STOPPED:
        return f"its tilt of {math.degrees(seen.tilt):.0f}° is beyond its own limit"
    if seen.status & Status.WATCHDOG_STOPPED:
        return "it had no command for too long (its watchdog)"
    return "it was stopped at its own side"
