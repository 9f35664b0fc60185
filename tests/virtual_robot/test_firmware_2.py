"""What version 2 of the protocol adds on the robot's side; `test_firmware` is for both versions."""

from dataclasses import replace

import pytest

from twbal.core.motor import Motor
from twbal.core.plant import Observation, Plant, WheelDifference
from twbal.link.decoder import Decoder, to_wire
from twbal.link.protocol import NEEDED, Arm, Clock, Command, Drive, Hello, PoseReport, Sensors, Status, Stop, Telemetry
from twbal.virtual_robot.firmware import Firmware, Identity

LOCKSTEP = Identity("paper", torque_limit=20.0, tilt_limit=1.0, watchdog=0.1, clock=Clock.LOCKSTEP)
REAL_TIME = replace(LOCKSTEP, clock=Clock.REAL_TIME)
PERIOD_US = 20_000


def heard(data):
    """What a robot says beside its true poses."""
    return [message for message in Decoder().feed(data) if not isinstance(message, PoseReport)]


def tell(firmware, *messages, now_us=0):
    return heard(firmware.receive(b"".join(map(to_wire, messages)), now_us))


def armed(plant, identity, now_us=0):
    firmware = Firmware(plant, identity)
    tell(firmware, Hello(1), Arm(2, 0), now_us=now_us)
    return firmware


class Turning(Plant):
    """A robot at rest that notes what its wheels get."""

    control_period = 0.02
    turns = True

    def __init__(self):
        self.got, self.apart = [], 0.0

    def reset(self, trial):
        self.apart = 0.0
        return Observation(*[0.0] * 7)

    def steer(self, difference):
        self.apart = difference

    def step(self, command):
        self.got.append((command, self.apart))
        return Observation(*[0.0] * 7)

    def wheel_difference(self):
        return WheelDifference(0.25, -0.5)

    def stop(self):
        pass

    def close(self):
        pass


@pytest.mark.parametrize(
    ("asked", "given", "limited"),
    [
        ((5.0, 3.0), (5.0, 3.0), False),
        ((5.0, -14.0), (5.0, -14.0), False),
        ((-18.0, 3.0), (-18.0, 2.0), True),
        ((25.0, 3.0), (20.0, 0.0), True),
        ((0.0, -50.0), (0.0, -20.0), True),
    ],
)
def test_balancing_goes_before_turning(asked, given, limited):
    firmware = armed(plant := Turning(), LOCKSTEP)
    (seen,) = tell(firmware, Command(3, *asked))
    assert plant.got == [given]
    assert (seen.applied, seen.applied_difference) == given
    assert bool(seen.status & Status.LIMITED) is limited
    assert (seen.wheel_difference, seen.difference_rate) == (0.25, -0.5)


def test_a_robot_says_what_it_measures_and_that_it_turns(sim_plant):
    (turning,) = tell(Firmware(Turning(), LOCKSTEP), Hello(1))
    (straight,) = tell(Firmware(sim_plant, LOCKSTEP), Hello(1))
    apart = Sensors.WHEEL_DIFFERENCE | Sensors.DIFFERENCE_RATE
    assert (turning.difference_limit, straight.difference_limit) == (20.0, 0.0)
    assert (turning.sensors & apart, straight.sensors & apart) == (apart, Sensors(0))
    assert NEEDED & ~straight.sensors == Sensors(0)


def test_voltages_become_torques_by_the_motor_of_the_robot():
    motor = Motor(resistance=2.0, torque_constant=0.05, gear=10.0, supply=12.0)  # 0.25 N·m/V for both wheels together
    firmware = Firmware(plant := Turning(), replace(LOCKSTEP, motor=motor))
    welcome, *_ = tell(firmware, Hello(1), Arm(2, 0, Drive.VOLTAGE))
    (seen,) = tell(firmware, Command(3, 8.0, 2.0))
    assert welcome.voltage_limit == 12.0
    assert plant.got == [(1.0, 0.25)]
    assert (seen.applied, seen.applied_difference) == (8.0, 2.0)
    tell(firmware, Arm(4, 0), Command(5, 8.0, 2.0))
    assert plant.got[-1] == (8.0, 2.0)


@pytest.mark.parametrize(
    ("drive", "why"), [(Drive.VOLTAGE, "take no voltages"), (Drive.ON_BOARD, "no policy on board")]
)
def test_a_robot_refuses_a_drive_that_it_does_not_have(sim_plant, drive, why):
    firmware = Firmware(sim_plant, LOCKSTEP)
    _, refused, off = tell(firmware, Hello(1), Arm(2, 0, drive), Command(3, 1.0))
    assert why in refused.text
    assert "motors are off" in off.text


@pytest.mark.parametrize("word", [Command(2, -20.0), Arm(65500, 9), Stop(2)])
def test_outdated_messages_are_dropped_and_counted(sim_plant, word):
    firmware = armed(sim_plant, LOCKSTEP)
    tell(firmware, Command(3, 5.0))
    assert tell(firmware, word) == []
    (seen,) = tell(firmware, Command(4, 5.0))
    assert (seen.period, seen.dropped) == (2, 1)


def test_numbers_go_on_across_their_overflow(sim_plant):
    firmware = Firmware(sim_plant, LOCKSTEP)
    tell(firmware, Hello(65534), Arm(65535, 0))
    assert [seen.period for seen in tell(firmware, Command(0, 1.0), Command(1, 1.0))] == [1, 2]


def test_damaged_frames_are_counted_in_the_telemetry(sim_plant):
    firmware = armed(sim_plant, LOCKSTEP)
    firmware.receive(b"\1\2\3\0\4\5\0", 0)
    (seen,) = tell(firmware, Command(3, 1.0))
    assert seen.dropped == 2


def test_late_commands_are_counted_and_the_last_ones_time_is_said(sim_plant):
    firmware = armed(sim_plant, REAL_TIME, now_us=1000)
    tell(firmware, Command(3, 1.0), now_us=5000)
    seen = heard(firmware.advance(1000 + 3 * PERIOD_US))
    assert [s.late for s in seen] == [0, 1, 2]
    assert {s.command_us for s in seen} == {5000}
    tell(firmware, Command(4, 1.0), now_us=62_000)
    (seen,) = heard(firmware.advance(1000 + 4 * PERIOD_US))
    assert (seen.late, seen.command_us) == (2, 62_000)


def test_in_lockstep_the_time_of_the_last_command_is_of_the_clock_that_stands_between_commands(sim_plant):
    firmware = Firmware(sim_plant, LOCKSTEP)
    told = [*tell(firmware, Hello(1), Arm(2, 0), now_us=10**9), *tell(firmware, Command(3, 1.0), now_us=2 * 10**9)]
    assert [(s.time_us, s.command_us) for s in told if isinstance(s, Telemetry)] == [(0, 0), (PERIOD_US, 0)]


@pytest.mark.parametrize("broken", ["tilt", "tilt_rate", "wheel_angle", "wheel_rate"])
@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_broken_sensor_that_it_is_balanced_by_stops_it(broken, value):
    firmware = armed(plant := Turning(), LOCKSTEP)
    plant.step = lambda torque: plant.got.append((torque, plant.apart)) or plant.reset(0)._replace(**{broken: value})
    (seen, after) = tell(firmware, Command(3, 5.0, 1.0), Command(4, 5.0, 1.0))
    assert seen.status == after.status == Status.SENSOR_STOPPED
    assert plant.got == [(5.0, 1.0), (0.0, 0.0)]
