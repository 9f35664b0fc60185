"""What version 2 of the protocol adds on the host's side; `test_serial_plant` is for both versions."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pendulum import MemoryTransport, Pendulum

from twbal.algorithm.rollout import rollout
from twbal.core.channels import Channels
from twbal.core.course import Course
from twbal.core.episode import Outcome, Provenance
from twbal.core.errors import ConfigError, DataError, LinkLostError, ProtocolError
from twbal.core.heading_control import HeadingControl
from twbal.core.motor import Motor
from twbal.core.plant import WheelDifference
from twbal.core.robot_parameters import RobotParameters
from twbal.link.decoder import Decoder, to_wire
from twbal.link.protocol import NEEDED, Arm, Clock, Command, Drive, Follow, Hello, Sensors, Status, Telemetry, Welcome
from twbal.link.serial_plant import SerialPlant
from twbal.link.version_1 import VERSION_1
from twbal.link.wheel_commands import WheelLimits
from twbal.policies.linear import LinearPolicy
from twbal.virtual_robot.firmware import Firmware, Identity

LOCKSTEP = Identity("pendulum", torque_limit=20.0, tilt_limit=1.0, watchdog=0.1, clock=Clock.LOCKSTEP)
MOTOR = Motor(resistance=2.0, torque_constant=0.05, gear=10.0, supply=60.0)  # 0.25 N·m/V for both wheels together


class Turning(Pendulum):
    """A pendulum whose wheels can be driven apart; `torques` are sum and difference."""

    turns = True

    def reset(self, trial):
        self.apart = 0.0
        return super().reset(trial)

    def steer(self, difference):
        self.apart = difference

    def step(self, command):
        seen = super().step(command)
        self.torques[-1] = (command, self.apart)
        return seen

    def wheel_difference(self):
        return WheelDifference(0.25, -0.5)


class Line(MemoryTransport):
    """A line that may change what the robot says; keeps what the host says."""

    def __init__(self, firmware, change=lambda said: said):
        super().__init__(firmware)
        self.got = []
        self.to_host = lambda data: b"".join(to_wire(change(said)) for said in Decoder().feed(data))

    def write(self, data):
        self.got += Decoder().feed(data)
        super().write(data)


def plant_of(robot, identity=LOCKSTEP, change=lambda said: said, motor=None):
    line = Line(Firmware(robot, identity), change)
    return SerialPlant(line, 0.5, 0.5, 0.5, motor=motor), line


def test_the_difference_reaches_the_wheels_until_it_is_set_to_another():
    plant, _ = plant_of(robot := Turning())
    plant.reset(0)
    plant.steer(1.5)
    plant.step(1.0)
    plant.step(-1.0)
    plant.steer(-0.5)
    plant.step(0.0)
    assert robot.torques == [(1.0, 1.5), (-1.0, 1.5), (0.0, -0.5)]
    assert plant.wheel_difference() == (0.25, -0.5)


def test_a_new_rollout_begins_without_difference():
    plant, _ = plant_of(robot := Turning())
    plant.reset(0)
    plant.steer(1.5)
    plant.reset(1)
    plant.step(1.0)
    assert robot.torques == [(1.0, 0.0)]


def test_the_host_leaves_to_a_turn_what_balancing_leaves():
    plant, line = plant_of(robot := Turning())
    plant.reset(0)
    plant.steer(-8.0)
    plant.step(15.0)
    assert robot.torques == [(15.0, -5.0)]
    assert line.got[-1].difference == -5.0


def limited_to(limit):
    """Has a robot announce a limit of the difference [N·m] below that of the sum."""

    def change(said):
        return replace(said, difference_limit=limit) if isinstance(said, Welcome) else said

    return change


def test_a_difference_beyond_what_the_robot_takes_is_noted_once_in_each_rollout():
    plant, line = plant_of(Turning(), change=limited_to(0.5))
    assert plant.difference_limit == 0.5
    for trial in range(2):
        plant.reset(trial)
        for difference in (0.4, 0.5, 0.8, -3.0):
            plant.steer(difference)
            plant.step(1.0)
        assert [said.difference for said in line.got[-4:]] == pytest.approx([0.4, 0.5, 0.5, -0.5])
        (event,) = plant.events
        assert event.text.startswith("difference of 0.8 N·m clipped to 0.5 N·m: the robot's limit is 0.5 N·m")
        assert event.time == pytest.approx(0.04)


def test_the_difference_that_is_logged_is_the_one_that_was_sent():
    """Of a turn that asks for more than the robot's board takes."""
    robot = RobotParameters("cart", 5.0, 0.25, 0.0, 0.1, 0.1, 0.05, 0.5, 0.1, 0.003, 0.03, 0.4, 20.0, 0.02)
    heading = Course.from_settings(robot, [{"turn": 180.0}]).heading
    plant, line = plant_of(Turning(), change=limited_to(0.3))
    policy, channels = LinearPolicy(("tilt",), np.array([-20.0]), 0.0, 20.0), Channels(("tilt",), 0.1)
    control = HeadingControl(robot, heading, plant.has_yaw_gyro)
    episode = rollout(plant, policy, channels, 20, 0.9, Provenance("cart", "robot"), heading=control)
    sent = [said.difference for said in line.got if isinstance(said, Command)]
    logged = [sample.difference for sample in control.samples[: len(episode.commands)]]
    assert max(map(abs, sent)) == pytest.approx(0.3)
    assert logged == pytest.approx(sent, abs=1e-6)
    assert not [event for event in plant.events if "difference" in event.text]


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_difference_that_is_no_number_is_refused(value):
    plant, _ = plant_of(Turning())
    plant.reset(0)
    with pytest.raises(DataError, match="not a finite number"):
        plant.steer(value)


@pytest.mark.parametrize(
    ("robot", "version", "why"),
    [
        (Turning(), VERSION_1, "it speaks version 1 of the link protocol, which knows one command"),
        (Pendulum(), 2, "it has one command"),
    ],
)
def test_a_robot_that_does_not_turn_says_so_and_is_driven_straight(robot, version, why):
    plant, _ = plant_of(robot, replace(LOCKSTEP, version=version))
    assert (plant.version, plant.turns) == (version, False)
    plant.reset(0)
    with pytest.raises(ConfigError, match=f"robot pendulum cannot be turned: {why}"):
        plant.steer(1.0)
    plant.step(1.0)


def test_a_robot_of_version_1_hears_the_hello_of_version_2_first_and_is_then_spoken_to_in_its_own():
    _, line = plant_of(Pendulum(), replace(LOCKSTEP, version=VERSION_1))
    assert line.got == [Hello(1, 2), Hello(2, 1)]


def test_a_robot_with_a_motor_is_sent_voltages_and_gets_the_torques():
    plant, line = plant_of(robot := Turning(), replace(LOCKSTEP, motor=MOTOR), motor=MOTOR)
    plant.reset(0)
    plant.steer(0.5)
    plant.step(3.0)
    assert (line.got[-1].total, line.got[-1].difference) == pytest.approx((24.0, 4.0))
    assert robot.torques[0] == pytest.approx((3.0, 0.5))


def test_voltages_are_cut_to_the_supply_balancing_first():
    weak = replace(MOTOR, supply=12.0)
    plant, line = plant_of(Turning(), replace(LOCKSTEP, motor=weak), motor=weak)
    plant.reset(0)
    plant.steer(5.0)
    plant.step(2.0)  # 16 V of the 24 V that both motors have together
    assert (line.got[-1].total, line.got[-1].difference) == pytest.approx((16.0, 8.0))


def test_a_robot_takes_no_more_than_its_motors_give_by_the_largest_voltage():
    weak = replace(MOTOR, supply=12.0)
    plant, line = plant_of(Turning(), replace(LOCKSTEP, motor=weak), motor=weak)
    assert plant.torque_limit == pytest.approx(3.0)  # of 24 V, at 0.125 N·m/V
    plant.reset(0)
    plant.step(4.0)
    assert line.got[-1].total == pytest.approx(24.0)
    assert "command of 4 N·m clipped to the robot's limit of 3 N·m" in [event.text for event in plant.events]


class OnBoard(Firmware):
    """Its own policy gives the motors 0.5 N·m."""

    def _welcome(self):
        return replace(super()._welcome(), policy=7)

    def _act(self, message, now_us):
        if isinstance(message, Arm):
            message = replace(message, drive=Drive.TORQUE)
        return super()._act(Command(message.seq, 0.5) if isinstance(message, Follow) else message, now_us)


@pytest.mark.parametrize("odd", [math.nan, 1e30, None])
def test_what_a_policy_on_board_cannot_have_given_ends_the_rollout_and_the_episode_is_kept(odd):
    def change(said):
        is_third = isinstance(said, Telemetry) and said.time_us == 60_000
        return replace(said, applied=odd) if is_third and odd is not None else said

    plant = SerialPlant(Line(OnBoard(Pendulum(), LOCKSTEP), change), 0.5, 0.5, 0.5, on_board=True)
    channels = Channels(("tilt", "tilt_rate"), wheel_radius=0.15)
    unheard = LinearPolicy(channels.names, np.zeros(2), 0.0, 20.0)
    episode = rollout(plant, unheard, channels, 5, 1.0, Provenance("pendulum", "robot"))
    if odd is None:
        assert episode.outcome is Outcome.COMPLETED and episode.commands.tolist() == [0.5] * 5
    else:
        assert (episode.outcome, episode.commands.tolist()) == (Outcome.LINK_LOST, [0.5] * 2)
        assert f"gave the motors {odd:g} N·m" in episode.events[0].text


def test_a_robot_that_takes_no_voltages_is_refused_with_a_motor():
    with pytest.raises(ConfigError, match=r"takes no voltages.*link\.motor=null"):
        plant_of(Turning(), motor=MOTOR)


def lacking(sensors):
    def change(said):
        return replace(said, sensors=said.sensors & ~sensors) if isinstance(said, Welcome) else said

    return change


@pytest.mark.parametrize("sensor", NEEDED)
def test_a_robot_that_lacks_what_balancing_needs_is_refused_before_anything_else_is_said(sensor):
    with pytest.raises(ProtocolError, match=f"no {sensor.name.lower().replace('_', ' ')}, without which"):
        plant_of(Pendulum(), change=lacking(sensor))


def test_absent_values_are_not_looked_at():
    absent = {"acceleration": math.nan, "yaw_rate": math.nan, "wheel_difference": 1e30}

    def change(said):
        if isinstance(said, Telemetry):
            return replace(said, **absent)
        return lacking(Sensors.ACCELERATION | Sensors.YAW_RATE | Sensors.WHEEL_DIFFERENCE)(said)

    plant, _ = plant_of(Turning(), change=change)
    seen = plant.reset(0)
    assert (seen.acceleration, seen.yaw_rate) == (0.0, 0.0)
    assert plant.wheel_difference() is None


@pytest.mark.parametrize("name", ["wheel_difference", "difference_rate", "battery"])
def test_a_value_that_is_announced_and_absent_ends_the_rollout(name):
    def change(said):
        if isinstance(said, Telemetry):
            return replace(said, **{"battery": 7.4, name: math.nan})
        return replace(said, sensors=said.sensors | Sensors.BATTERY) if isinstance(said, Welcome) else said

    plant, _ = plant_of(Turning(), change=change)
    with pytest.raises(LinkLostError, match=f"not finite numbers \\({name}\\)"):
        plant.reset(0)


def test_frames_that_the_robot_dropped_are_noted():
    plant, line = plant_of(Turning())
    plant.reset(0)
    line.firmware.receive(b"\x01\x02\x00\x03\x04\x00", 0)
    plant.step(0.0)
    plant.step(0.0)
    assert [event.text for event in plant.events] == ["the robot dropped 2 damaged or outdated frames"]


def test_commands_that_the_robot_cut_below_the_limit_that_it_announced_are_noted_once():
    plant, line = plant_of(Turning())
    plant.reset(0)
    plant.step(20.0)
    line.firmware._limits = WheelLimits(5.0, 5.0)  # such as where its battery sags
    for command in (5.0, 6.0, 1.0, -20.0):
        plant.step(command)
    (event,) = plant.events
    assert event.text.startswith("in 2 control periods the robot cut the command below the limit that it announced")
    assert event.time == pytest.approx(0.04)


@pytest.mark.parametrize("on_board", [Status(0), Status.ON_BOARD])
def test_a_cut_by_the_board_is_noted_where_the_host_commands(on_board):
    def cut(said):
        return replace(said, status=said.status | Status.LIMITED | on_board) if isinstance(said, Telemetry) else said

    plant, _ = plant_of(Turning(), change=cut)
    plant.reset(0)
    plant.step(1.0)
    assert len(plant.events) == (0 if on_board else 1)


def test_after_a_watchdog_it_is_said_how_old_the_last_command_was_and_not_the_last_measurement():
    class Slow(MemoryTransport):
        asleep_us = 0

        def write(self, data):
            super().write(data)
            self.pass_time(self.asleep_us)

    line = Slow(Firmware(Pendulum(), replace(LOCKSTEP, clock=Clock.REAL_TIME)), us_per_read=1000)
    plant = SerialPlant(line, 0.5, 0.5, 0.5)
    plant.reset(0)
    line.asleep_us = 60_000  # in which three measurements come
    plant.step(1.0)
    line.asleep_us = 0
    line.pass_time(45_000)
    with pytest.raises(
        LinkLostError, match=r"By its clock 1[12]\d ms passed from the last command that it took to the"
    ):
        plant.step(1.0)


@pytest.mark.parametrize(
    ("field", "value"),
    [("difference_limit", math.nan), ("difference_limit", -1.0), ("voltage_limit", 0.0), ("voltage_limit", math.inf)],
)
def test_limits_that_cannot_be_are_refused(field, value):
    def change(said):
        return replace(said, **{field: value}) if isinstance(said, Welcome) else said

    with pytest.raises(ProtocolError, match="announces what cannot be"):
        plant_of(Turning(), change=change)
