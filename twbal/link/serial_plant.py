"""The plant behind a link: a real robot, or a virtual one; from this side there is no difference."""

import math
import time
from collections.abc import Callable
from typing import Self

from twbal.episode import Event
from twbal.errors import DataError, LinkError, LinkLostError, ProtocolError
from twbal.link.protocol import (
    VERSION,
    Arm,
    Clock,
    Command,
    Decoder,
    Fault,
    Hello,
    Message,
    Status,
    Stop,
    Telemetry,
    Welcome,
    to_wire,
)
from twbal.link.transport import SerialTransport, Transport
from twbal.plant import Observation, Plant

_RESEND_AFTER = 0.05  # an unanswered message is sent again: within the robot's watchdog of 0.1 s [s]
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
            ProtocolError: it speaks another version.
            LinkError: it does not answer.
        """
        self._transport = transport
        self._connect_timeout, self._arm_timeout, self._timeout = connect_timeout, arm_timeout, timeout
        self._confirm_placed = confirm_placed
        self._decoder = Decoder()
        self._seq = 0
        self._armed = self._lost = self._closed = False
        self._events: list[Event] = []
        self._elapsed = 0.0  # on the robot's clock, in the current rollout [s]
        self.missed_periods = 0
        try:
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
        """What happened on the line in the current rollout: missed periods, clipped commands, an unanswered stop."""
        return tuple(self._events)

    @property
    def bad_frames(self) -> int:
        """Frames that arrived damaged since the plant was opened."""
        return self._decoder.bad_frames

    def reset(self, trial: int) -> Observation:
        """Have the robot placed, arm it and return its first observation; see `Plant.reset`.

        Raises:
            LinkError: it does not answer, or does not arm.
        """
        self.stop()
        if self._lost:
            self._shake_hands()
        if self._confirm_placed is not None:
            self._confirm_placed(trial)
        self._events.clear()
        self._elapsed = 0.0
        self.missed_periods = 0
        self._armed = True  # as far as can be known: from here on the way out must disarm
        self._last = self._first = self._telemetry(Arm(self._next(), trial), self._arm_timeout)
        if not self._last.status & Status.ARMED:
            raise LinkError(
                f"The robot {self.robot_name} does not arm: {_why_stopped(self._last)}. Place it at its start."
            )
        return self._observation(self._last)

    def step(self, command: float) -> Observation:
        """Command a torque and return the next telemetry; see `Plant.step`.

        On a robot in real time the next telemetry is the first one that knows of this command. Where the host was too
        late for a control period, the robot has held the command before; such periods are counted and noted in
        `events`.

        Raises:
            LinkLostError: the robot fell silent, has switched its motors off, or measures what is no number.
            DataError: the command is not a finite number.
        """
        if not math.isfinite(command):
            raise DataError(f"The policy commands {command} N·m, which is not a finite number. The robot is stopped.")
        if not self._armed or self._lost or not self._last.status & Status.ARMED:
            raise LinkLostError(f"The robot {self.robot_name} is not armed: {self._why_not_driven()}. Reset it first.")
        before = self._last
        try:
            self._last = self._telemetry(Command(self._next(), self._clip(command)), self._timeout)
        except LinkError as error:
            self._lost = True
            raise LinkLostError(str(error)) from error
        self._count_missed((self._last.period - before.period) % 2**16 - 1)
        if not self._last.status & (Status.ARMED | Status.TILT_STOPPED):  # the command may not have acted
            raise LinkLostError(f"The robot {self.robot_name} stopped itself: {_why_stopped(self._last)}.")
        return self._observation(self._last)

    def stop(self) -> None:
        """Disarm and wait for the robot to say so; one that does not is left to its own watchdog."""
        if not self._armed:
            return
        try:
            self._telemetry(Stop(self._next()), self._timeout)
        except LinkError as error:
            if not self._lost:
                self._note(f"no answer to the stop: {error}")
            self._lost = True
        self._armed = False  # not before: where Ctrl-C cuts this short, closing sends the stop again

    def close(self) -> None:
        """Disarm and close the port."""
        if self._closed:
            return
        self._closed = True
        try:
            self.stop()
        finally:
            self._transport.close()

    def _shake_hands(self) -> None:
        welcome = self._ask(Hello(self._next()), self._connect_timeout)
        if not isinstance(welcome, Welcome):
            raise ProtocolError(f"The robot on {self._transport.name} answers Hello with {welcome}; expected Welcome.")
        if welcome.version != VERSION:
            raise ProtocolError(
                f"The robot on {self._transport.name} speaks version {welcome.version} of the link protocol, this "
                f"twbal version {VERSION}. Update the older of the two."
            )
        if welcome.control_period_us == 0 or not welcome.torque_limit > 0:
            raise ProtocolError(f"The robot on {self._transport.name} announces what cannot be: {welcome}.")
        self.control_period = welcome.control_period_us * 1e-6
        self.robot_name, self.torque_limit, self.clock = welcome.name, welcome.torque_limit, Clock(welcome.clock)
        self._lost = False

    def _next(self) -> int:
        self._seq = (self._seq + 1) % 2**16
        return self._seq

    def _telemetry(self, message: Message, timeout: float) -> Telemetry:
        """Send `message` and return the telemetry that answers it."""
        answer = self._ask(message, timeout)
        if not isinstance(answer, Telemetry):
            raise ProtocolError(
                f"The robot on {self._transport.name} answers {message} with {answer}; expected Telemetry."
            )
        return answer

    def _ask(self, message: Message, timeout: float) -> Message:
        """Send `message`, again where no answer comes, and return the latest answer to it."""
        wire = to_wire(message)
        deadline = time.monotonic() + timeout
        resend_at = 0.0
        now = 0.0
        while now < deadline:  # looked at before the read: an answer that came while this process slept still counts
            now = time.monotonic()
            if now >= resend_at:
                self._transport.write(wire)
                resend_at = now + _RESEND_AFTER
            answers = [m for m in self._decoder.feed(self._transport.read()) if m.seq == message.seq]
            if answers and isinstance(answers[-1], Fault):
                raise LinkError(f"The robot on {self._transport.name} cannot follow: {answers[-1].text}.")
            if answers:
                return answers[-1]
        raise LinkError(
            f"No answer to {type(message).__name__} from the robot on {self._transport.name} within {timeout:g} s "
            f"({self._decoder.bad_frames} damaged frames so far). Is it switched on, and is the baud rate right?"
        )

    def _clip(self, command: float) -> float:
        if abs(command) > self.torque_limit * _FLOAT32_SLACK:
            self._note(f"command of {command:.3g} N·m clipped to the robot's limit of {self.torque_limit:.3g} N·m")
        return min(max(command, -self.torque_limit), self.torque_limit)

    def _count_missed(self, periods: int) -> None:
        if periods > 0:
            self.missed_periods += periods
            self._note(f"{periods} control periods passed without a command in time")

    def _note(self, text: str) -> None:
        self._events.append(Event(self._elapsed, text))

    def _observation(self, seen: Telemetry) -> Observation:
        broken = [name for name, value in vars(seen).items() if not math.isfinite(value)]
        if broken:
            raise LinkLostError(
                f"The robot {self.robot_name} sends values that are not finite numbers ({', '.join(broken)}); its "
                "motors are stopped. Is that sensor connected?"
            )
        self._elapsed = (seen.time_us - self._first.time_us) % 2**32 * 1e-6
        return Observation(
            time=self._elapsed,
            tilt=seen.tilt,
            tilt_rate=seen.tilt_rate,
            acceleration=seen.acceleration,
            wheel_angle=(seen.wheel_left + seen.wheel_right) / 2,
            wheel_rate=(seen.rate_left + seen.rate_right) / 2,
            yaw_rate=seen.yaw_rate,
        )

    def _why_not_driven(self) -> str:
        if self._lost:
            return "the link was lost"
        return _why_stopped(self._last) if self._armed else "it was stopped, or never reset"


def _why_stopped(seen: Telemetry) -> str:
    if seen.status & Status.TILT_STOPPED:
        return f"its tilt of {math.degrees(seen.tilt):.0f}° is beyond its own limit"
    if seen.status & Status.WATCHDOG_STOPPED:
        return "it had no command for too long (its watchdog)"
    return "it was stopped at its own side"
