"""What docs/protocol.md asks of every robot: one suite for the virtual robot, the firmware and a robot in memory.

In lockstep first; what asks for time runs in real time. Robots are simulated, and leave no difference for wheels.
"""

import math
import time

import numpy as np
import pytest
from building import needs_compiler, program
from talking import MemoryHost, robot_of

from twbal.link.decoder import to_wire
from twbal.link.frame import wrap
from twbal.link.protocol import (
    NEEDED,
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

KINDS = ["memory", "mujoco", pytest.param("firmware", marks=needs_compiler)]
PERIOD_US = 20_000


@pytest.fixture(scope="module", params=KINDS)
def lockstep(request):
    with robot_of(request.param, Clock.LOCKSTEP, program) as hosts:
        yield hosts


IN_TIME = ["memory", pytest.param("mujoco", marks=pytest.mark.slow), *KINDS[2:]]


@pytest.fixture(scope="module", params=IN_TIME)
def real_time(request):
    with robot_of(request.param, Clock.REAL_TIME, program) as hosts:
        yield hosts


@pytest.fixture
def host(lockstep):
    made = lockstep()
    yield made
    made.close()


@pytest.fixture
def timed(real_time):
    made = real_time()
    yield made
    made.close()


def is_armed(seen):
    return bool(seen.status & Status.ARMED)


# Handshake


def test_hello_is_answered_by_what_the_robot_is(host):
    welcome = host.greet()
    assert isinstance(welcome, Welcome)
    assert (welcome.version, welcome.control_period_us, welcome.clock) == (2, PERIOD_US, Clock.LOCKSTEP)
    assert welcome.torque_limit == 20.0
    assert 0 <= welcome.difference_limit <= 20.0
    assert welcome.sensors & NEEDED == NEEDED
    assert welcome.name


@pytest.mark.parametrize("version", [0, 1, 3, 65535])
def test_a_host_of_another_version_is_told_the_robots_and_not_obeyed(host, version):
    host.greet()
    assert host.ask(Hello, version).version == 2
    for word in ((Arm, 0), (Command, 1.0, 0.0), (Stop,)):
        assert isinstance(host.ask(*word), Fault)
    assert isinstance(host.ask(Hello, 2), Welcome)
    assert is_armed(host.ask(Arm, 0))


def test_hello_switches_the_motors_off(host):
    host.arm()
    host.ask(Hello, 2)
    assert isinstance(host.ask(Command, 1.0, 0.0), Fault)


def test_hello_is_obeyed_each_time_whatever_its_number(host):
    host.arm()
    for number in (host.number, host.number - 7, 0, 65535):
        assert isinstance(host.ask(Hello, 2, seq=number % 2**16), Welcome)
    host.number = 65535
    assert is_armed(host.ask(Arm, 0))  # its number is 0


# Numbers


def test_a_command_that_is_repeated_acts_once_and_is_answered_alike(host):
    host.arm()
    first = host.command(2.0)
    again = host.command(-5.0, seq=first.seq)  # a repetition whatever it says
    assert to_wire(again) == to_wire(first)
    assert host.command(2.0).period == first.period + 1


def test_a_fault_is_repeated_too(host):
    host.greet()
    first = host.ask(Command, 1.0, 0.0)
    again = host.ask(Stop, seq=first.seq)
    assert isinstance(first, Fault)
    assert again == first


@pytest.mark.parametrize("behind", [1, 100, 2**15])
def test_what_is_outdated_is_dropped_and_counted(host, behind):
    host.arm()
    before = host.command(1.0)
    host.say(Command, 5.0, 0.0, seq=(before.seq - behind) % 2**16)
    after = host.command(1.0)
    assert after.period == before.period + 1
    assert (after.dropped - before.dropped) % 2**16 == 1
    assert [m.seq for m in host.heard[-2:]] == [before.seq, after.seq]  # nothing answered it


@pytest.mark.parametrize("ahead", [2, 2**15 - 1])
def test_what_is_ahead_is_new(host, ahead):
    host.arm()
    before = host.command(1.0)
    host.number = (before.seq + ahead - 1) % 2**16
    assert host.command(1.0).period == before.period + 1


# Arming


def test_arming_switches_the_motors_on_without_torque(host):
    seen = host.arm()
    assert isinstance(seen, Telemetry)
    assert is_armed(seen)
    assert (seen.period, seen.late, seen.applied) == (0, 0, 0.0)


def test_what_is_announced_is_a_number_and_nothing_else_is(host):
    announced = host.greet().sensors
    seen = host.ask(Arm, 0)
    values = {
        "tilt": seen.tilt,
        "tilt_rate": seen.tilt_rate,
        "acceleration": seen.acceleration,
        "wheel_angle": seen.wheel_angle,
        "wheel_rate": seen.wheel_rate,
        "wheel_difference": seen.wheel_difference,
        "difference_rate": seen.difference_rate,
        "yaw_rate": seen.yaw_rate,
        "heading": seen.heading,
        "battery": seen.battery,
    }
    assert {name for name, value in values.items() if math.isfinite(value)} == {
        sensor.name.lower() for sensor in Sensors if sensor & announced
    }


def test_a_simulated_robot_begins_a_trial_alike_each_time(host):
    first, other, again = (host.arm(trial) for trial in (3, 4, 3))
    assert (first.tilt, first.tilt_rate) == (again.tilt, again.tilt_rate)
    assert first.tilt != other.tilt


def test_arming_anew_begins_anew(host):
    host.arm()
    for _ in range(3):
        host.command(4.0)
    seen = host.ask(Arm, 0)
    assert (seen.period, seen.applied, is_armed(seen)) == (0, 0.0, True)


@pytest.mark.parametrize("drive", [Drive.VOLTAGE, Drive.ON_BOARD])
def test_a_drive_that_the_robot_lacks_is_refused_and_leaves_it_as_it_was(host, drive):
    host.arm()
    assert isinstance(host.ask(Arm, 0, drive), Fault)
    assert is_armed(host.command(1.0))
    host.stop()
    assert isinstance(host.ask(Arm, 0, drive), Fault)
    assert isinstance(host.ask(Command, 1.0, 0.0), Fault)


def test_a_command_before_arming_is_refused(host):
    host.greet()
    assert isinstance(host.ask(Command, 1.0, 0.0), Fault)


# Driving


def test_each_command_advances_time_by_a_period(host):
    first = host.arm()
    seen = [host.command(0.5) for _ in range(4)]
    assert [s.period for s in seen] == [1, 2, 3, 4]
    assert [s.time_us - first.time_us for s in seen] == [PERIOD_US * k for k in (1, 2, 3, 4)]
    assert [s.applied for s in seen] == [0.5] * 4


@pytest.mark.parametrize("asked", [1000.0, -1000.0, 20.5, 3e38])
def test_a_command_beyond_the_limit_is_cut_and_says_so(host, asked):
    host.arm()
    seen = host.command(asked)
    assert seen.applied == math.copysign(20.0, asked)
    assert seen.status & Status.LIMITED
    assert not host.command(1.0).status & Status.LIMITED


def test_a_difference_gets_no_more_than_is_left(host):
    most = host.greet().difference_limit
    host.ask(Arm, 0)
    seen = host.command(5.0, 1000.0)
    assert (seen.applied, seen.applied_difference) == (5.0, min(most, 15.0))
    assert seen.status & Status.LIMITED


@pytest.mark.parametrize("odd", [(math.nan, 0.0), (0.0, math.nan), (math.inf, 0.0), (0.0, -math.inf)])
def test_a_command_that_is_no_number_is_refused_and_the_robot_stays_armed(host, odd):
    host.arm()
    before = host.command(3.0)
    assert isinstance(host.ask(Command, *odd), Fault)
    after = host.command(3.0)
    assert is_armed(after)
    assert (after.period, after.applied) == (before.period + 1, 3.0)


def test_a_reference_is_refused_where_the_host_drives(host):
    host.arm()
    before = host.command(3.0)
    assert isinstance(host.ask(Follow, 0.0, 0.0, math.nan, 0.0), Fault)
    assert host.command(3.0).period == before.period + 1


def test_a_robot_that_leans_too_far_stops_itself_until_it_is_armed_again(host):
    host.arm()
    seen = host.command(-20.0)
    for _ in range(200):
        if not is_armed(seen):
            break
        seen = host.command(-20.0 if seen.tilt > 0 else 20.0)
    assert seen.status == Status.TILT_STOPPED
    after = host.command(20.0)
    assert (after.status, after.applied) == (Status.TILT_STOPPED, 0.0)
    assert after.period == seen.period + 1
    assert is_armed(host.ask(Arm, 0))


# Stop


def test_stop_is_proven_by_telemetry_and_ends_the_rollout(host):
    host.arm()
    host.command(4.0)
    seen = host.ask(Stop)
    assert isinstance(seen, Telemetry)
    assert not is_armed(seen)
    assert isinstance(host.ask(Command, 1.0, 0.0), Fault)
    assert not is_armed(host.ask(Stop))


# Noise


@pytest.mark.parametrize(
    "noise",
    [
        b"\x17noise without a border",
        wrap(b"\x7f\x01\x00what is that?"),
        wrap(b"\x06\x01\x00short"),
        wrap(b"\x05\xff\xff\0\0\0\0\x09"),  # a drive that there is not
        wrap(b"\x83\x01\x00\xff\xfe"),  # a text that is no UTF-8
        bytes([0, 5, 6, 7, 8]) + bytes(range(1, 250)) * 2,
        to_wire(Command(7, 3.0, 0.0))[:-3],
    ],
)
def test_what_is_no_message_is_dropped_counted_and_changes_nothing(host, noise):
    host.arm()
    before = host.command(1.0)
    host.write(noise)
    after = host.command(1.0)
    assert after.period == before.period + 1
    assert (after.dropped - before.dropped) % 2**16 == 1
    assert [m.seq for m in host.heard[-2:]] == [before.seq, after.seq]


def test_a_frame_with_any_byte_changed_is_never_obeyed(host):
    host.arm()
    before = host.command(1.0)
    frame = to_wire(Command(before.seq + 1, 2.0, 0.0))
    for place in range(1, len(frame) - 1):
        spoilt = bytearray(frame)
        spoilt[place] ^= 0x41
        host.write(bytes(spoilt))
    host.number += 10
    after = host.command(1.0)
    assert after.period == before.period + 1
    assert after.dropped > before.dropped


def test_frames_may_come_byte_by_byte_and_close_together(host):
    host.arm()
    before = host.command(1.0)
    numbers = [host.next() for _ in range(3)]
    for byte in b"".join(to_wire(Command(number, 1.0, 0.0)) for number in numbers):
        host.write(bytes([byte]))
    after = host.wait(lambda m: m.seq == numbers[-1], 0)
    assert after.period == before.period + 3


@pytest.mark.parametrize("word", [Telemetry, Fault, Welcome, PoseReport])
def test_a_robots_own_word_is_refused(host, word):
    host.arm()
    before = host.command(1.0)
    fields = {
        Telemetry: (0, 0, 1, *[0.0] * 3, 0.0, 0.0),
        Fault: ("no",),
        Welcome: (2, 20_000, 1.0),
        PoseReport: (0, *[0.0] * 4),
    }[word]
    assert isinstance(host.ask(word, *fields), Fault)
    assert host.command(1.0).period == before.period + 1


# Real time


def test_telemetry_streams_each_period_and_the_command_is_held(timed):
    timed.arm()
    began = timed.command(0.25)
    timed.wait(lambda m: m.period >= began.period + 3)
    seen = [m for m in timed.heard if isinstance(m, Telemetry)]
    assert [s.period for s in seen] == list(range(len(seen)))
    assert set(np.diff([s.time_us for s in seen]).tolist()) == {PERIOD_US}
    assert [s.applied for s in seen if s.period > began.period][:3] == [0.25] * 3
    assert seen[-1].late >= 2


def test_the_watchdog_stops_the_motors_after_a_tenth_of_a_second(timed):
    timed.arm()
    timed.command(0.25)
    tripped = timed.wait(lambda m: isinstance(m, Telemetry) and m.status & Status.WATCHDOG_STOPPED)
    last = [m for m in timed.heard if isinstance(m, Telemetry) and is_armed(m)][-1]
    assert last.time_us - last.command_us <= 100_000
    assert tripped.time_us - tripped.command_us > 100_000
    assert tripped.time_us - last.time_us == PERIOD_US
    assert not is_armed(tripped)
    assert timed.wait(lambda m: m.period >= tripped.period + 2).applied == 0.0
    timed.say(Command, 5.0, 0.0)
    assert not is_armed(timed.wait(lambda m: m.seq == timed.number, 0))
    assert is_armed(timed.ask(Arm, 0))


@pytest.mark.parametrize("how", ["repeated", "outdated", "damaged", "not a number"])
def test_what_is_no_new_and_valid_command_does_not_hold_off_the_watchdog(timed, how):
    timed.arm()
    first = timed.command(0.25)
    wire = {
        "repeated": lambda: to_wire(Command(first.seq, 0.25, 0.0)),
        "outdated": lambda: to_wire(Command(first.seq - 1, 0.25, 0.0)),
        "damaged": lambda: to_wire(Command(timed.next(), 0.25, 0.0))[:-4],
        "not a number": lambda: to_wire(Command(timed.next(), math.nan, 0.0)),
    }[how]
    seen, deadline = first, time.monotonic() + 20.0
    while is_armed(seen) and time.monotonic() < deadline:
        timed.write(wire())
        seen = timed.wait(lambda m: isinstance(m, Telemetry), timed.heard.index(seen) + 1)
    assert seen.status & Status.WATCHDOG_STOPPED


def test_after_stop_there_is_silence(timed):
    timed.arm()
    timed.command(0.25)
    timed.stop()
    timed.silence()  # what was on its way
    assert timed.silence() == []


def test_a_robot_whose_port_was_closed_wants_a_handshake(real_time):
    first = real_time()
    first.arm()
    first.close()
    if isinstance(first, MemoryHost):
        second = first  # its line has no ends
    else:
        time.sleep(1.0)  # it looks every 20 ms
        second = real_time()
    assert isinstance(second.ask(Arm, 0), Fault)
    second.close()
