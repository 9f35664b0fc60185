"""The plant behind a link: a real robot, or a virtual one; from this side there is no difference."""

import math
from collections.abc import Callable
from contextlib import suppress
from typing import Self

from twbal.core.episode import Event
from twbal.core.errors import ConfigError, DataError, LinkError, LinkLostError, MotorsOnError, ProtocolError
from twbal.core.motor import Motor
from twbal.core.plant import Observation, Plant, Pose, WheelDifference
from twbal.link.exchange import Exchange
from twbal.link.handshake import Needs, greet, shake_hands, what_changed
from twbal.link.line_notes import LineNotes
from twbal.link.message import Message
from twbal.link.protocol import (
    Arm,
    Command,
    Drive,
    Follow,
    Sensors,
    Status,
    Stop,
    Telemetry,
    Welcome,
)
from twbal.link.ranges import MAX_CLOCK_STEP_US, MAX_TORQUE, MAX_TRIAL, check_timeouts, odd_values
from twbal.link.telemetry_meaning import advice_on_arming, advice_on_silence, observation_of, says_off, why_stopped
from twbal.link.transport import SerialTransport, Transport
from twbal.link.version_1 import VERSION_1
from twbal.link.wheel_commands import WheelCommands, WheelLimits, torque_per_voltage

_STOPS = 3  # how often Stop is sent to a robot that does not say that its motors are off


class SerialPlant(Plant):
    """A robot on a line: shakes hands, arms it for each rollout, and drives it.

    Attributes:
        control_period: as the robot announced it [s].
        robot_name: as announced.
        torque_limit: to which commands are clipped: as announced, or what its motors give at a standstill by the
            largest voltage, if they are sent voltages [N·m].
        command_limit: the same.
        difference_limit: to which differences of the wheel torques are clipped, where balancing leaves more: as
            announced [N·m]; 0: it does not turn.
        clock: lockstep, or real time.
        version: of the protocol that it speaks.
        firmware: number of its build, as announced; 0: unknown.
        policy: number of the policy on board, as announced; 0: none.
        deploy: command that puts another policy on board, as given.
        turns: whether it takes a difference of the wheel torques.
        sensors: what it measures.
    """

    def __init__(
        self,
        transport: Transport,
        connect_timeout: float,
        arm_timeout: float,
        timeout: float,
        confirm_placed: Callable[[int], None] | None = None,
        motor: Motor | None = None,
        on_board: bool = False,
        deploy: str | None = None,
    ) -> None:
        """Shake hands with the robot; the transport is closed where that fails.

        Args:
            transport: line to the robot; closed with this plant.
            connect_timeout: how long the robot may take to say who it is; some boot when the port opens [s].
            arm_timeout: how long it may take to arm [s].
            timeout: silence in a rollout after which the link is lost [s].
            confirm_placed: called with the trial's number before each arming; returns when the robot stands at its
                start. None: the robot places itself.
            motor: that turns torques into the voltages which the robot is then sent; None: it is sent torques. The
                back-EMF acts as viscous friction of the robot, as in `twbal.core.motor`.
            on_board: the policy on board of the robot drives: commands are not sent, but the reference is, and what
                the motors were given is read.
            deploy: shell command that puts another policy on board, for who has one; None: a person does.

        Raises:
            ProtocolError: it speaks another version, or announces what cannot be.
            LinkError: it does not answer.
            ConfigError: a time is not positive, or without end.
        """
        self._line, self._port, self.deploy = Exchange(transport), transport.name, deploy
        self._connect_timeout, self._arm_timeout, self._timeout = connect_timeout, arm_timeout, timeout
        self._confirm_placed, self._motor, self._on_board = confirm_placed, motor, on_board
        self._reference, self._gives_way = (0.0, 0.0), False  # position [m] and speed [m/s], for the policy on board
        self._armed = self._lost = self._closed = False
        self._unstopped: MotorsOnError | None = None  # what is known of motors that may still be on
        self._notes = LineNotes(self._line)
        self._announced: Welcome | None = None
        self._pose: Pose | None = None
        self._difference = 0.0  # of the wheel torques [N·m]
        self._elapsed_us = 0  # on the robot's clock, in the current rollout [µs]
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
        motor: Motor | None = None,
        on_board: bool = False,
        deploy: str | None = None,
    ) -> Self:
        """The plant behind a serial port or URL; see `SerialTransport` and the constructor."""
        line = SerialTransport(port, baud_rate)
        return cls(line, connect_timeout, arm_timeout, timeout, confirm_placed, motor, on_board, deploy)

    @property
    def events(self) -> tuple[Event, ...]:
        """What happened on the line in the current rollout: missed periods, damaged frames, clipped commands."""
        return self._notes.events

    @property
    def missed_periods(self) -> int:
        """Control periods of the current rollout that passed without a command in time."""
        return self._notes.missed_periods

    @property
    def line(self) -> Exchange:
        """The messages under it, for who looks at the line itself; arming goes through `reset`, which also disarms."""
        return self._line

    @property
    def telemetry(self) -> Telemetry:
        """The newest telemetry that was used; there is one after a `reset`."""
        return self._last

    @property
    def bad_frames(self) -> int:
        """Frames that arrived damaged since the plant was opened."""
        return self._line.bad_frames

    def reset(self, trial: int) -> Observation:
        """Have the robot placed, arm it and return its first observation; see `Plant.reset`.

        Raises:
            LinkError: it does not answer, does not arm, or is another one than before the link was lost; or this plant
                was closed.
            LinkLostError: it measures what cannot be.
            ConfigError: the number does not fit into a message.
        """
        self.check_open()
        if not 0 <= trial <= MAX_TRIAL:
            raise ConfigError(f"The number of a trial must be 0 to {MAX_TRIAL}; found {trial}.")
        if self._armed:
            self.stop()
        if self._lost:
            self._shake_hands()
        self._unstopped = None
        if self._confirm_placed is not None:
            self._confirm_placed(trial)
        self._elapsed_us, self._difference = 0, 0.0
        self._armed = True  # as far as can be known: from here on the way out must disarm
        drive = Drive.TORQUE if self._motor is None else Drive.VOLTAGE
        drive = Drive.ON_BOARD if self._on_board else drive
        self._reference, self._gives_way = (0.0, 0.0), False
        self._last = self._telemetry(Arm(self._line.next_number(), trial, drive), self._arm_timeout)
        self._notes.begin()  # while it armed, it may have been asked again and again
        if not self._last.status & Status.ARMED:
            raise LinkError(
                f"The robot {self.robot_name} does not arm: {why_stopped(self._last)}. {advice_on_arming(self._last)}"
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
            LinkError: this plant was closed.
            DataError: the command is not a finite number.
        """
        if not math.isfinite(command):
            raise DataError(f"The command {command} N·m is not a finite number; it was not sent.")
        self.check_open()
        if not self._armed or self._lost or not self._last.status & Status.ARMED:
            raise LinkLostError(f"The robot {self.robot_name} is not armed: {self._why_not_driven()}. Reset it first.")
        before = self._last
        try:
            self._last = self._telemetry(self._order(command), self._timeout)
        except LinkError as error:
            self._lost = True
            raise LinkLostError(str(error)) from error
        self._notes.follow(before, self._last, self._elapsed)
        if not self._last.status & (Status.ARMED | Status.TILT_STOPPED):  # the command may not have acted
            reason, advice = why_stopped(self._last), advice_on_silence(before, self._last, self.version)
            raise LinkLostError(f"The robot {self.robot_name} stopped itself: {reason}.{advice}")
        self._follow_clock(before, self._last)
        if self._on_board and not abs(self._last.applied) <= MAX_TORQUE:  # not so of a NaN
            raise LinkLostError(
                f"The robot {self.robot_name} says that its policy gave the motors {self._last.applied:g} N·m; "
                f"expected its limit of {self.torque_limit:g} N·m at most."
            )
        return self._observation(self._last)

    def _order(self, command: float) -> Message:
        number = self._line.next_number()
        if self._on_board:
            return Follow(number, *self._reference, heading=math.nan, yaw_rate=0.0, gives_way=int(self._gives_way))
        return Command(number, *self._clip(command))

    def applied(self) -> float | None:
        """What the policy on board gave the motors in the last control period; None where the host drives."""
        return self._last.applied if self._on_board else None

    def follow(self, position: float, speed: float, gives_way: bool = False) -> None:
        """Set the reference of the policy on board; see `Plant.follow`."""
        self._reference, self._gives_way = (position, speed), gives_way

    def steer(self, difference: float) -> None:
        """Set the difference of the wheel torques; see `Plant.steer`.

        Raises:
            ConfigError: the robot does not take one.
            DataError: the difference is not a finite number.
        """
        if not math.isfinite(difference):
            raise DataError(f"The difference {difference} N·m is not a finite number; it was not sent.")
        if not self.turns:
            raise ConfigError(f"The robot {self.robot_name} cannot be turned: {self.why_straight}.")
        self._difference = difference

    @property
    def why_straight(self) -> str:
        """Why the robot cannot be turned, as part of a sentence."""
        if self._on_board:
            return "the policy on board drives straight ahead"
        if self.version == VERSION_1:
            return f"it speaks version {VERSION_1} of the link protocol, which knows one command for both wheels"
        return "it has one command for both wheels"

    @property
    def is_placed_by_hand(self) -> bool:
        """Whether a person places the robot before each rollout; otherwise it places itself."""
        return self._confirm_placed is not None

    @property
    def tells_heading(self) -> bool:
        """Whether something tells its heading: a gyro's yaw rate, or the difference of its wheels."""
        return bool(self.sensors & (Sensors.YAW_RATE | Sensors.WHEEL_DIFFERENCE))

    def wheel_difference(self) -> WheelDifference | None:
        """How far the wheels are apart, as the last telemetry says; None where the robot does not measure it."""
        if not self._lost and self._armed and self.sensors & Sensors.WHEEL_DIFFERENCE:
            is_told = self.sensors & Sensors.DIFFERENCE_RATE
            return WheelDifference(self._last.wheel_difference, self._last.difference_rate if is_told else math.nan)
        return None

    def pose(self) -> Pose | None:
        """What the robot said of its true pose with the last observation; None where it said nothing."""
        return self._pose

    def stop(self) -> None:
        """Switch the motors off and wait until the robot says that they are.

        Raises:
            MotorsOnError: it does not say so, or did not at the last stop. Its own watchdog is then all that is left.
        """
        if self._unstopped is not None:
            raise self._unstopped
        if not self._armed:
            return
        try:
            self._switch_off()
        except LinkError as error:
            text = (
                f"The robot {self.robot_name} does not confirm that its motors are off, and THEY MAY STILL BE ON: "
                f"switch it off by hand. ({error})"
            )
            self._lost, self._unstopped = True, MotorsOnError(text)
            self._armed = False  # after that, so that Ctrl-C in between does not make it look stopped
            raise self._unstopped from error
        self._armed = False  # not before: where Ctrl-C cuts this short, the next call sends the stop again

    def stop_again(self) -> None:
        """Stop a robot that was stopped before, as what it was told since then may have armed it; raises as `stop`."""
        self._armed = True  # as far as can be known
        self.stop()

    def close(self) -> None:
        """Switch the motors off, unless that failed before, and close the port; raises as `stop`."""
        try:
            try:
                if self._armed:
                    self.stop()
            except KeyboardInterrupt:
                self.stop()
                raise
        finally:
            self._line.transport.close()
            self._closed = True

    def check_open(self) -> None:
        """Check that this plant can still be driven.

        Raises:
            LinkError: it was closed, as at the end of its `with` block.
        """
        if self._closed:
            raise LinkError(
                f"This plant was closed, and the port {self._port} of the robot {self.robot_name} with it: its `with` "
                "block has ended, or `close` was called. Connect anew, and drive within the `with` block."
            )

    def _switch_off(self) -> None:
        """Send Stop until the answer lacks the armed bit.

        Between two of them a Hello stops the motors, too, and makes a robot obey that has started anew.
        """
        patience = self._timeout / _STOPS
        for left in reversed(range(_STOPS)):
            try:
                self._line.ask(Stop(self._line.next_number()), patience, until=says_off)
                return
            except LinkError:
                if not left:
                    raise
            with suppress(LinkError):
                greet(self._line, patience)
                self._lost = True  # it may have started anew: the next rollout begins with a whole handshake

    def _shake_hands(self) -> None:
        """Learn who the robot is."""
        needs = Needs(voltages=self._motor is not None, policy_on_board=self._on_board)
        welcome = shake_hands(self._line, self._port, self._connect_timeout, needs)
        if self._announced and (changed := what_changed(self._announced, welcome)):
            raise ProtocolError(
                f"The robot on {self._port} is not what it was before the link was lost: {changed}. Connect to it "
                "anew, so that it is held against its sheet."
            )
        self._announced = welcome
        self.control_period = welcome.control_period_us * 1e-6
        self.robot_name, self.clock = welcome.name, welcome.clock
        self.firmware, self.policy = welcome.firmware, welcome.policy
        self.version, self.sensors = welcome.version, welcome.sensors
        self.torque_limit, most = welcome.torque_limit, math.inf
        if self._motor is not None:
            most = 2.0 * min(self._motor.supply, welcome.voltage_limit)
            self.torque_limit = min(self.torque_limit, most * torque_per_voltage(self._motor))
        self.command_limit, self.difference_limit = self.torque_limit, welcome.difference_limit
        self._limits, self._voltages = WheelLimits(self.torque_limit, welcome.difference_limit), WheelLimits(most, most)
        self.turns = welcome.difference_limit > 0 and not self._on_board
        self.has_yaw_gyro = Sensors.YAW_RATE in welcome.sensors
        self._lost = False

    def _telemetry(self, message: Message, timeout: float) -> Telemetry:
        """Send `message` and return the telemetry that answers it."""
        answer = self._line.ask(message, timeout)
        if not isinstance(answer, Telemetry):
            raise ProtocolError(f"The robot on {self._port} answers {message} with {answer}; expected Telemetry.")
        return answer

    def _clip(self, command: float) -> WheelCommands:
        """What is sent for a torque, in the unit of the arming, within the robot's limits."""
        if not self._limits.allow(WheelCommands(command)):
            text = f"command of {command:.3g} N·m clipped to the robot's limit of {self.torque_limit:.3g} N·m"
            self._notes.add(self._elapsed, text)
        done = self._limits.cut(WheelCommands(command, self._difference))
        if not self._limits.allow(WheelCommands(done.total, self._difference)):
            text = (
                f"difference of {self._difference:.3g} N·m clipped to {done.difference:.3g} N·m: the robot's limit is "
                f"{self.difference_limit:.3g} N·m, and what the command leaves; later ones are not noted"
            )
            self._notes.add_once(self._elapsed, "difference", text)
        if self._motor is None:
            return done
        return self._voltages.cut(done.times(1.0 / torque_per_voltage(self._motor)))

    def _follow_clock(self, before: Telemetry, now: Telemetry) -> None:
        advance = (now.time_us - before.time_us) % 2**32
        if not 0 < advance <= MAX_CLOCK_STEP_US:
            raise LinkLostError(
                f"The clock of the robot {self.robot_name} does not run forward: it says {before.time_us} µs, and then "
                f"{now.time_us} µs; expected at most {MAX_CLOCK_STEP_US * 1e-6:g} s more."
            )
        self._elapsed_us += advance

    @property
    def _elapsed(self) -> float:
        """On the robot's clock, in the current rollout [s]."""
        return self._elapsed_us * 1e-6

    def _observation(self, seen: Telemetry) -> Observation:
        if odd := odd_values(seen, self.sensors):
            raise LinkLostError(f"The robot {self.robot_name} sends {odd}. Is that sensor connected?")
        self._pose = self._true_pose()
        return observation_of(seen, self.sensors, self._elapsed)

    def _true_pose(self) -> Pose | None:
        said = self._line.pose
        if said is None:
            return None
        if odd := odd_values(said, self.sensors):
            raise LinkLostError(f"The robot {self.robot_name} sends a pose with {odd}. What does it take it from?")
        return Pose(said.x, said.y, said.heading, said.tilt)

    def _why_not_driven(self) -> str:
        if self._lost:
            return "the link was lost"
        return why_stopped(self._last) if self._armed else "it was stopped, or never reset"
