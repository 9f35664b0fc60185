"""Whatever goes wrong on the line, with the robot or at the keyboard: the motors are off, and the episode is kept."""

import math
import struct
import sys
from dataclasses import replace

import numpy as np
import pytest
from hydra import compose
from hydra.utils import instantiate
from pendulum import MemoryTransport, Pendulum

from twbal.algorithm.rollout import rollout
from twbal.cli.composition import composing
from twbal.core.channels import Channels
from twbal.core.episode import Outcome, Provenance
from twbal.core.errors import ConfigError, LinkError, LinkLostError, MotorsOnError, ProtocolError
from twbal.link.decoder import Decoder, to_wire
from twbal.link.frame import wrap
from twbal.link.protocol import Arm, Clock, Hello, Status, Stop, Telemetry, Welcome
from twbal.link.serial_plant import SerialPlant
from twbal.link.version_1 import VERSION_1
from twbal.policies.policy import Policy
from twbal.virtual_robot.firmware import Firmware, Identity

LOCKSTEP = Identity("pendulum", torque_limit=20.0, tilt_limit=1.0, watchdog=0.1, clock=Clock.LOCKSTEP)
REAL_TIME = replace(LOCKSTEP, clock=Clock.REAL_TIME)
CHANNELS = Channels(("tilt", "tilt_rate"), wheel_radius=0.15)
STEPS = 3
TIMEOUT = 0.06


class Catch(Policy):
    """u = 30 θ + 8 θ̇; counts its calls, and after `calm` of them does what `then` does."""

    def __init__(self, calm=10**9, then=lambda: None):
        self.calm, self.then, self.calls = calm, then, 0

    def controller(self, rng):
        def law(state):
            self.calls += 1
            if self.calls > self.calm:
                self.then()
            return float(30.0 * state[0] + 8.0 * state[1])

        return law


def drive(plant, policy=None, steps=STEPS, channels=CHANNELS):
    return rollout(plant, policy or Catch(), channels, steps, math.radians(30), Provenance("pendulum", "robot"))


class Line(MemoryTransport):
    """A line that may change each telemetry.

    Attributes:
        got: messages that came to the robot.
        said: messages of the robot, as they were.
    """

    def __init__(self, identity=LOCKSTEP, change=lambda seen: seen, **line):
        super().__init__(Firmware(Pendulum(), identity), **line)
        self.change = change
        self.got, self.said = [], []
        self.to_host = self._changed

    def write(self, data):
        sent = self.to_robot(data)
        self.got += Decoder().feed(sent)
        self._waiting += self.to_host(self.firmware.receive(sent, self.now_us))

    def _changed(self, data):
        said = Decoder().feed(data)
        self.said += said
        return b"".join(to_wire(self.change(m) if isinstance(m, Telemetry) else m) for m in said)

    @property
    def is_armed(self):
        """Whether the motors are on, as the robot knows."""
        return bool(self.said) and isinstance(self.said[-1], Telemetry) and Status.ARMED in self.said[-1].status


def plant_on(line, timeout=TIMEOUT):
    return SerialPlant(line, 1.0, 1.0, timeout)


# A stop is done when the robot says that its motors are off


def kinds_of(messages):
    return [type(message) for message in messages]


def test_a_robot_that_stays_armed_is_told_to_stop_again_and_ends_as_a_lost_link():
    line = Line(change=lambda seen: replace(seen, status=Status.ARMED))
    plant = plant_on(line)
    episode = drive(plant)
    assert (len(episode), episode.outcome) == (STEPS, Outcome.LINK_LOST)
    (event,) = episode.events
    assert "does not confirm that its motors are off" in event.text
    assert "says that it is armed" in event.text
    sent = {message.seq: type(message) for message in line.got}
    assert list(sent.values())[2 + STEPS :] == [Stop, Hello, Stop, Hello, Stop]
    assert isinstance(line.got[-1], Stop)


def test_a_stop_that_was_not_confirmed_is_not_taken_for_one_later_and_closing_says_nothing_more():
    line = Line(change=lambda seen: replace(seen, status=Status.ARMED))
    plant = plant_on(line)
    plant.reset(0)
    for _ in range(2):
        with pytest.raises(MotorsOnError, match="THEY MAY STILL BE ON"):
            plant.stop()
    sent = len(line.got)
    plant.close()
    assert len(line.got) == sent


def test_a_robot_that_obeys_the_second_stop_has_completed():
    stops = []

    def deaf_to_the_first(data):
        (message,) = Decoder().feed(data)
        if isinstance(message, Stop):
            stops.append(message.seq)
        return b"" if stops and message.seq == stops[0] else data

    line = Line()
    line.to_robot = deaf_to_the_first
    episode = drive(plant_on(line))
    assert (episode.outcome, episode.events) == (Outcome.COMPLETED, ())
    assert len(set(stops)) == 2


def test_a_robot_that_has_started_anew_in_a_rollout_confirms_its_stop_after_a_hello():
    line = Line()
    episode = drive(plant_on(line), Catch(1, line.firmware.host_gone))
    assert episode.outcome is Outcome.LINK_LOST
    (event,) = episode.events
    assert "no handshake" in event.text
    assert kinds_of(line.got)[-3:] == [Stop, Hello, Stop]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"torque_limit": 5.0}, "torque limit 5 instead of 20"),
        ({"name": "other"}, "name other instead of pendulum"),
        ({"firmware": 7}, "firmware 7 instead of 0"),
    ],
)
@pytest.mark.parametrize("in_a_rollout", [True, False])
def test_a_robot_that_is_another_one_after_it_has_started_anew_is_not_driven(change, said, in_a_rollout):
    line = Line()
    plant = plant_on(line)

    def other():
        line.firmware = Firmware(Pendulum(), replace(LOCKSTEP, **change))

    if in_a_rollout:
        assert drive(plant, Catch(1, other)).outcome is Outcome.LINK_LOST
    else:
        other()
        with pytest.raises(
            LinkError, match=r"no handshake.* So it has started anew since the last one: does its supply"
        ):
            plant.reset(0)
        plant.stop()
    with pytest.raises(ProtocolError, match=f"is not what it was before the link was lost: {said}"):
        plant.reset(1)
    assert kinds_of(line.got)[-1] is Hello


def test_a_robot_that_has_started_anew_between_rollouts_is_driven_again_after_one_error():
    line = Line()
    plant = plant_on(line)
    drive(plant)
    line.firmware = Firmware(Pendulum(), LOCKSTEP)
    with pytest.raises(LinkError, match="no handshake"):
        drive(plant)
    assert drive(plant).outcome is Outcome.COMPLETED


def test_an_arming_that_is_not_answered_and_not_undone_says_that_the_motors_may_be_on():
    line = Line()
    plant = plant_on(line)
    line.to_host = lambda data: b""
    plant._arm_timeout = TIMEOUT
    with pytest.raises(LinkLostError, match="THEY MAY STILL BE ON"):
        drive(plant)
    assert isinstance(line.got[-1], Stop)


# Every number that drives or ends a rollout is one that can be


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("torque_limit", math.inf),
        ("torque_limit", math.nan),
        ("torque_limit", -20.0),
        ("torque_limit", 1e6),
        ("control_period_us", 0),
        ("control_period_us", 1),
        ("control_period_us", 2**32 - 1),
    ],
)
def test_a_welcome_that_cannot_be_is_refused_before_anything_else_is_said(field, value):
    class OddRobot(Line):
        def _changed(self, data):
            said = Decoder().feed(data)
            return b"".join(to_wire(replace(m, **{field: value}) if isinstance(m, Welcome) else m) for m in said)

    line = OddRobot()
    with pytest.raises(ProtocolError, match=f"announces what cannot be: a {field[:6].replace('_', ' ')}"):
        plant_on(line)
    assert kinds_of(line.got) == [Hello]
    assert line.closed


@pytest.mark.parametrize("value", [3e38, -3e38, 1e7, math.inf, math.nan])
@pytest.mark.parametrize(
    "name",
    ["tilt", "tilt_rate", "acceleration", "wheel_angle", "wheel_rate", "yaw_rate"],
)
def test_a_measurement_that_cannot_be_ends_the_rollout_and_the_episode_so_far_is_kept(name, value):
    line = Line(change=lambda seen: replace(seen, **{name: value}) if seen.period == 2 else seen)
    episode = drive(plant_on(line))
    assert (len(episode), episode.outcome) == (1, Outcome.LINK_LOST)
    assert name in episode.events[0].text
    assert isinstance(line.got[-1], Stop)


def test_what_robots_measure_is_let_through():
    violent = {"tilt": 3.1, "tilt_rate": 35.0, "acceleration": 160.0, "yaw_rate": 35.0}
    wheels = {"wheel_angle": -1e5, "wheel_difference": 2e5, "wheel_rate": 700.0, "difference_rate": -1400.0}
    line = Line(change=lambda seen: replace(seen, **violent, **wheels) if seen.period == STEPS else seen)
    assert drive(plant_on(line)).outcome is Outcome.COMPLETED


@pytest.mark.parametrize("name", ["connect_timeout", "arm_timeout", "timeout"])
@pytest.mark.parametrize("value", [-1.0, 0.0, math.nan, math.inf, 1e9])
def test_a_time_that_cannot_be_waited_for_is_refused_and_named(name, value):
    times = {"connect_timeout": 1.0, "arm_timeout": 1.0, "timeout": 1.0, name: value}
    line = Line()
    with pytest.raises(ConfigError, match=rf"link\.{name} must be more than 0 and at most 3600 s; found"):
        SerialPlant(line, **times)
    assert line.got == []
    assert line.closed


@pytest.mark.parametrize("trial", [-1, 2**32])
def test_a_trial_that_no_robot_can_be_told_is_refused_before_arming(trial):
    line = Line()
    with pytest.raises(ConfigError, match="number of a trial must be 0 to 4294967295"):
        plant_on(line).reset(trial)
    assert kinds_of(line.got) == [Hello]


def test_a_robot_without_accelerometer_and_yaw_gyro_is_driven_by_the_default_state_as_one_with_both():
    def without(seen):
        return replace(seen, acceleration=0.0, yaw_rate=0.0)

    def turning(seen):
        return replace(seen, acceleration=0.7, yaw_rate=0.3)

    with composing():
        channels = instantiate(compose("real_rollout", ["policy.path=none"]).state)
    bare, full = (drive(plant_on(Line(change=change)), channels=channels) for change in (without, turning))
    np.testing.assert_array_equal(bare.states, full.states)
    np.testing.assert_array_equal(bare.commands, full.commands)


# The robot's clock


@pytest.mark.parametrize("then", [20_000, 10_000, 0, 20_000 + 11_000_000])
def test_a_clock_that_stands_or_goes_back_or_leaps_ends_the_rollout_and_the_episode_so_far_is_kept(then):
    line = Line(change=lambda seen: replace(seen, time_us=then) if seen.period == 2 else seen)
    episode = drive(plant_on(line))
    assert (len(episode), episode.outcome) == (1, Outcome.LINK_LOST)
    assert f"does not run forward: it says 20000 µs, and then {then} µs" in episode.events[0].text
    assert isinstance(line.got[-1], Stop)


def test_time_runs_on_where_the_clock_overflows_more_than_once():
    line = Line(change=lambda seen: replace(seen, time_us=seen.period * 9_000_000 % 2**32))
    episode = drive(plant_on(line), steps=1000)  # 9000 s; the clock overflows every 4295 s
    assert episode.observations[:, 0] == pytest.approx(9.0 * np.arange(1001))


def test_missed_periods_are_counted_across_the_overflow_of_their_counter():
    line = Line(REAL_TIME, lambda seen: replace(seen, period=(seen.period + 2**16 - 3) % 2**16), us_per_read=1000)
    plant = plant_on(line)
    plant.reset(0)
    for _ in range(5):
        plant.step(0.0)
    assert plant.missed_periods == 0
    line.pass_time(50_000)  # two and a half control periods
    plant.step(0.0)
    assert plant.missed_periods == 2


def test_a_counter_of_periods_that_stands_is_noted_once_and_does_not_end_the_rollout():
    episode = drive(plant := plant_on(Line(change=lambda seen: replace(seen, period=0))))
    assert (len(episode), episode.outcome, plant.missed_periods) == (STEPS, Outcome.COMPLETED, 0)
    assert [event.text for event in plant.events] == [
        "the robot's count of its control periods does not run forward, so missed ones are not noticed"
    ]


# True reasons


def answer_to_hello(payload):
    class OddRobot(Line):
        def write(self, data):
            self._waiting += wrap(payload)

    with pytest.raises(LinkError) as refusal:
        SerialPlant(OddRobot(), TIMEOUT, 1.0, 1.0)
    return str(refusal.value)


@pytest.mark.parametrize(("clock", "name", "reason"), [(7, b"bob", "7 is not a valid Clock"), (1, b"bob\xff", "utf-8")])
def test_a_welcome_that_cannot_be_read_is_not_blamed_on_the_baud_rate(clock, name, reason):
    said = answer_to_hello(struct.pack("<BHHIfB", 0x81, 1, VERSION_1, 20_000, 20.0, clock) + name)
    assert reason in said
    assert "docs/protocol.md" in said
    assert "baud rate" not in said


def test_a_fault_is_told_without_control_characters():
    said = answer_to_hello(b"\x83\x01\x00\x1b]0;owned\x07battery")
    assert "cannot follow" in said
    assert said.isprintable()


def test_a_fault_is_heard_although_telemetry_streams_on():
    line = Line(REAL_TIME, us_per_read=20_000)  # the fault and the telemetry after it lie in one read
    plant = plant_on(line)
    plant.reset(0)
    line.to_robot = lambda data: to_wire(replace(Decoder().feed(data)[0], total=math.nan))
    with pytest.raises(LinkLostError, match="a torque of nan"):
        plant.step(0.0)


# Ctrl-C, or a port that goes, at any instant


class Trapped(Line):
    """At its call number `at` of read or write raises `trap`, before it or `after` it. A lost port stays lost."""

    def __init__(self, at, trap, after=False):
        self.at, self.trap, self.after, self.calls = at, trap, after, 0
        super().__init__(REAL_TIME, us_per_read=1000)

    def _trapped(self, call):
        self.calls += 1
        springs = self.calls == self.at or (self.calls > self.at and isinstance(self.trap, LinkLostError))
        if springs and not self.after:
            raise self.trap
        result = call()
        if springs:
            raise self.trap
        return result

    def read(self):
        return self._trapped(super().read)

    def write(self, data):
        return self._trapped(lambda: Line.write(self, data))


def driven(line, policy):
    """The episode, or what was raised instead."""
    try:
        with plant_on(line, timeout=1.0) as plant:
            return drive(plant, policy)
    except (KeyboardInterrupt, LinkLostError) as raised:
        return raised


def calls_of_a_rollout():
    line = Trapped(10**9, KeyboardInterrupt)
    assert driven(line, Catch()).outcome is Outcome.COMPLETED
    return line.calls


@pytest.mark.parametrize("after", [False, True], ids=["before", "after"])
@pytest.mark.parametrize("at", range(1, calls_of_a_rollout() + 1))
def test_ctrl_c_at_any_call_of_the_line_leaves_the_robot_off_and_the_episode_kept(at, after):
    line, policy = Trapped(at, KeyboardInterrupt, after), Catch()
    result = driven(line, policy)
    assert not line.is_armed
    assert line.closed
    if Arm in kinds_of(line.got):
        assert isinstance(line.got[-1], Stop)
    if policy.calls:  # there was an observation
        assert result.outcome is Outcome.STOPPED
        assert result.events[-1].text == "stopped by the person"
        assert 0 <= policy.calls - len(result) <= 1
    else:
        assert isinstance(result, KeyboardInterrupt)


@pytest.mark.parametrize("at", range(1, calls_of_a_rollout() + 1, 3))
def test_a_port_that_goes_at_any_call_leaves_the_robot_to_its_watchdog_and_the_episode_kept(at):
    line, policy = Trapped(at, LinkLostError("the port is gone")), Catch()
    result = driven(line, policy)
    line.pass_time(200_000)
    assert not line.is_armed
    if policy.calls:
        assert result.outcome is Outcome.LINK_LOST
        assert "THEY MAY STILL BE ON" in result.events[-1].text
        assert 0 <= policy.calls - len(result) <= 1
    else:
        assert isinstance(result, LinkLostError)


class Interrupted:
    """Raises KeyboardInterrupt at the line number `at` that is executed in the files that drive a robot."""

    FILES = ("algorithm/rollout.py", "serial_plant.py", "exchange.py")

    def __init__(self, at):
        self.left = at

    def __enter__(self):
        self._before = sys.gettrace()
        sys.settrace(self._trace)

    def __exit__(self, *error):
        sys.settrace(self._before)

    def _trace(self, frame, event, argument):
        if not frame.f_code.co_filename.endswith(self.FILES):
            return None
        if event == "line":
            self.left -= 1
            if not self.left:
                raise KeyboardInterrupt
        return self._trace


def test_ctrl_c_at_any_line_leaves_the_robot_off_and_the_episode_kept():
    for at in range(1, 10**9):
        line, policy, interrupted = Line(REAL_TIME, us_per_read=5000), Catch(), Interrupted(at)
        with plant_on(line, timeout=1.0) as plant:
            try:
                with interrupted:
                    result = drive(plant, policy, steps=2)
            except KeyboardInterrupt as pressed:
                result = pressed
        assert not line.is_armed
        if Arm in kinds_of(line.got):
            assert isinstance(line.got[-1], Stop)
        if policy.calls:  # there was an observation
            assert result.outcome is (Outcome.STOPPED if interrupted.left <= 0 else Outcome.COMPLETED)
        if interrupted.left > 0:  # the rollout has fewer lines
            break
    assert at > 200
