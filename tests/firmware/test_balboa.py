"""The Balboa's board file, whose line is USB: packets of 64 bytes, less than a frame of telemetry."""

import math
import subprocess

import pytest
from building import build_folder, make, needs_compiler

from twbal.link.decoder import Decoder, to_wire
from twbal.link.protocol import Arm, Command, Fault, Hello, Status, Stop, Telemetry, Welcome

pytestmark = needs_compiler


def run(milliseconds, *messages, host_reads=True, lost=(), force=()):
    """What the robot says to messages 5 ms apart, how often it waited for the host, and the largest duty of a motor.

    Args:
        host_reads: whether the host takes what the robot says.
        lost: a register of the IMU, and how many writes to it are lost.
        force: specific force along x and z of the IMU, as it counts.
    """
    program = build_folder() / "balboa_line"
    make(str(program))
    frames = " ".join(to_wire(message).hex() for message in messages)
    words = [
        program,
        str(milliseconds),
        str(int(host_reads)),
        frames,
        *map(str, lost or (force and (0, 0))),
        *map(str, force),
    ]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    said, waited, speed = done.stdout.splitlines()
    return Decoder().feed(bytes.fromhex(said)), int(waited), int(speed) / 400


def talk(milliseconds, *messages, **given):
    """What the robot says, and how often it waited; see `run`."""
    return run(milliseconds, *messages, **given)[:2]


def test_each_period_of_an_armed_robot_is_telemetry_that_arrives_whole():
    commands = [Command(number, 0.0) for number in range(3, 33)]
    (welcome, *seen), waited = talk(200, Hello(1), Arm(2, 0), *commands)
    assert isinstance(welcome, Welcome)
    assert all(isinstance(each, Telemetry) and each.status & Status.ARMED for each in seen)
    assert [each.period for each in seen] == list(range(len(seen)))
    assert len(seen) >= 17
    assert waited == 0


def test_answers_that_come_at_once_do_not_spoil_each_other():
    heard, _ = talk(100, Hello(1), Stop(2), Arm(3, 0), Arm(4, 0), Command(4, 0.0), Stop(5), Command(6, 0.0))
    assert [type(each) for each in heard if not isinstance(each, Telemetry)] == [Welcome, Fault]
    assert [each.seq for each in heard if isinstance(each, Telemetry)][:3] == [2, 3, 4]


@pytest.mark.parametrize("milliseconds", [200, 300])
def test_a_host_that_does_not_read_never_holds_the_loop(milliseconds):
    commands = [Command(number, 0.0) for number in range(3, 43)]
    said, waited = talk(milliseconds, Hello(1), Arm(2, 0), *commands, host_reads=False)
    assert waited == 0
    assert isinstance(said[0], Welcome)


@pytest.mark.parametrize("register", [0x10, 0x11, 0x12])
def test_a_robot_whose_imu_is_not_set_up_is_not_armed(register):
    (_, fault), _ = talk(100, Hello(1), Arm(2, 0), lost=(register, 10**6))
    assert isinstance(fault, Fault) and fault.text == "the sensors do not answer"
    (_, armed, *_), _ = talk(100, Hello(1), Arm(2, 0), lost=(register, 2))
    assert isinstance(armed, Telemetry) and armed.status & Status.ARMED


def test_a_motor_gets_all_of_the_voltage_that_telemetry_says():
    torque, commands = 1.8, [Command(number, 1.8) for number in range(3, 33)]
    (_, *seen), _, duty = run(200, Hello(1), Arm(2, 0), *commands)
    assert seen[-1].applied == pytest.approx(torque)
    assert not any(each.status & Status.LIMITED for each in seen)
    assert duty == pytest.approx(0.5 * torque * 2.70 / (110.1 * 3.2e-3) / 7.2, abs=0.005)  # at a standstill


@pytest.mark.parametrize("lean", [0.4, -0.4])
def test_a_lean_forward_is_positive_as_pololus_example_has_it(lean):
    """Its Balancer has angle = atan2(a.z, a.x), and drives forward at a positive one."""
    force = [round(8192 * part) & 0xFFFF for part in (math.cos(lean), math.sin(lean))]
    (_, *seen), _ = talk(300, Hello(1), Arm(2, 0), *[Command(n, 0.0) for n in range(3, 43)], force=force)
    assert seen[-1].tilt == pytest.approx(lean, abs=0.01)
