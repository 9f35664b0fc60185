"""The Balboa's board file, whose line is USB: packets of 64 bytes, less than a frame of telemetry."""

import subprocess

import pytest
from building import build_folder, make, needs_compiler

from twbal.link.decoder import Decoder, to_wire
from twbal.link.protocol import Arm, Command, Fault, Hello, Status, Stop, Telemetry, Welcome

pytestmark = needs_compiler


def talk(milliseconds, *messages, host_reads=True, lost=()):
    """What the robot says to messages 5 ms apart, and how often it had to wait for the host to take it.

    Args:
        host_reads: whether the host takes what the robot says.
        lost: a register of the IMU, and how many writes to it are lost.
    """
    program = build_folder() / "balboa_line"
    make(str(program))
    frames = " ".join(to_wire(message).hex() for message in messages)
    words = [program, str(milliseconds), str(int(host_reads)), frames, *map(str, lost)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    said, waited = done.stdout.splitlines()
    return Decoder().feed(bytes.fromhex(said)), int(waited)


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
