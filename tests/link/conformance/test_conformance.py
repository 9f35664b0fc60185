"""What docs/protocol.md asks of every robot: one suite for those of this repository, and for yours by `--robot`.

In lockstep first, where the robot has it; what asks for time runs in real time. Torques are shares of what the robot
announces. On a port of its own, which may be that of a real robot, nothing asks it to lean.
"""

import math
import time

import numpy as np
import pytest
from building import needs_compiler
from starting import PERL_ROBOT, checked, is_port, needs_perl, robot_of
from talking import MemoryHost, StandingHost, as_float32

from twbal.link.decoder import to_wire
from twbal.link.frame import wrap
from twbal.link.protocol import (
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
from twbal.link.ranges import odd_announcement

PERL = pytest.param(PERL_ROBOT, id="perl", marks=needs_perl)
FIRMWARE = pytest.param("firmware", marks=needs_compiler)
ROBOTS = {
    "lockstep": ["memory", "mujoco", FIRMWARE, PERL],
    "real_time": ["memory", pytest.param("mujoco", marks=pytest.mark.slow), FIRMWARE, PERL],
}
ALL_DRIVES = [PERL]  # robots that take voltages, and have a policy on board


def pytest_generate_tests(metafunc):
    given = metafunc.config.getoption("--robot", default=None)
    yours = given and [pytest.param(checked(given), id="robot")]
    takes_all = {"takes_voltages", "has_policy"} & set(metafunc.fixturenames)
    for fixture, ours in ROBOTS.items():
        if fixture in metafunc.fixturenames:
            metafunc.parametrize(fixture, yours or (ALL_DRIVES if takes_all else ours), indirect=True, scope="module")


@pytest.fixture(scope="module")
def standing(request):
    """A host on the port that is given; both clocks share it. None: a program is given, or nothing."""
    given = request.config.getoption("--robot", default=None)
    host = StandingHost(given) if given and is_port(given) else None
    yield host
    if host:
        host.leave()


@pytest.fixture(scope="module")
def lockstep(request, standing):
    with robot_of(request.param, Clock.LOCKSTEP, standing) as hosts:
        yield hosts


@pytest.fixture(scope="module")
def real_time(request, standing):
    with robot_of(request.param, Clock.REAL_TIME, standing) as hosts:
        host = hosts()
        clock = host.greet().clock
        host.close()
        if clock is not Clock.REAL_TIME:
            pytest.skip("the robot runs in lockstep")
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


@pytest.fixture
def takes_voltages(host):
    if not announces(host.greet(), Drive.VOLTAGE):
        pytest.skip("the robot takes no voltages")


@pytest.fixture
def has_policy(timed):
    if not announces(timed.greet(), Drive.ON_BOARD):
        pytest.skip("the robot has no policy on board")


def announces(welcome, drive):
    return welcome.voltage_limit > 0 if drive is Drive.VOLTAGE else welcome.policy != 0


def as_sent(value):
    """A command that is told back: a mean of float32."""
    return pytest.approx(value, rel=1e-6)


def a_period(host):
    """Between two instants on the robot's clock; clocks of real robots, and of busy machines, vary [µs]."""
    period = host.welcome.control_period_us
    return pytest.approx(period, abs=0 if host.is_ours else period / 2)


def is_armed(seen):
    return bool(seen.status & Status.ARMED)


# Handshake


def test_hello_is_answered_by_what_the_robot_is(host):
    welcome = host.greet()
    assert isinstance(welcome, Welcome)
    assert welcome.version == 2
    assert odd_announcement(welcome) == ""
    assert welcome.name
    if host.is_ours:
        assert (welcome.control_period_us, welcome.torque_limit, welcome.clock) == (20_000, 20.0, Clock.LOCKSTEP)


@pytest.mark.parametrize("version", [0, 1, 3, 65535])
def test_a_host_of_another_version_is_told_the_robots_and_not_obeyed(host, version):
    host.greet()
    assert host.ask(Hello, version).version == 2
    for word in ((Arm, 0), (Command, 0.0, 0.0), (Stop,)):
        host.refused(*word)
    assert isinstance(host.ask(Hello, 2), Welcome)
    assert is_armed(host.ask(Arm, 0))


def test_hello_switches_the_motors_off(host):
    host.arm()
    host.greet()
    host.refused(Command, 0.0, 0.0)


def test_hello_is_obeyed_each_time_whatever_its_number(host):
    host.arm()
    for number in (host.number, host.number - 7, 0, 65535):
        host.ask(Hello, 2, seq=number % 2**16, wanted=lambda m: isinstance(m, Welcome))
    host.number = 65535
    assert is_armed(host.ask(Arm, 0))  # its number is 0


# Numbers


def test_a_command_that_is_repeated_acts_once_and_is_answered_alike(host):
    host.arm()
    share = host.torque(0.1)
    first = host.command(share)
    if host.is_lockstep:
        again = host.command(-2 * share, seq=first.seq)  # a repetition whatever it says
        assert to_wire(again) == to_wire(first)
    else:
        host.say(Command, -2 * share, 0.0, seq=first.seq)
        assert host.wait(lambda m: m.period == first.period + 1, 0).applied == as_sent(share)
    assert host.follows(host.command(share), first)


def test_a_fault_is_repeated_too(host):
    host.greet()
    first = host.refused(Command, 0.0, 0.0)
    assert host.ask(Stop, seq=first.seq) == first


@pytest.mark.parametrize("behind", [1, 100, 2**15])
def test_what_is_outdated_is_dropped_and_counted(host, behind):
    host.arm()
    before = host.command(host.torque(0.05))
    host.say(Command, host.torque(0.25), 0.0, seq=(before.seq - behind) % 2**16)
    after = host.command(host.torque(0.05))
    assert host.follows(after, before)
    assert (after.dropped - before.dropped) % 2**16 == 1
    assert host.since(before) == [before.seq, after.seq]  # nothing answered it


@pytest.mark.parametrize("ahead", [2, 2**15 - 1])
def test_what_is_ahead_is_new(host, ahead):
    host.arm()
    before = host.command(host.torque(0.05))
    host.number = (before.seq + ahead - 1) % 2**16
    assert host.follows(host.command(host.torque(0.05)), before)


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
    if not host.is_simulated:
        pytest.skip("a person places a real robot")
    first, other, again = (host.arm(trial) for trial in (3, 4, 3))
    assert (first.tilt, first.tilt_rate) == (again.tilt, again.tilt_rate)
    assert first.tilt != other.tilt


def test_arming_anew_begins_anew(host):
    host.arm()
    for _ in range(3):
        host.command(host.torque(0.2))
    seen = host.ask(Arm, 0)
    assert (seen.period, seen.applied, is_armed(seen)) == (0, 0.0, True)


@pytest.mark.parametrize("drive", [Drive.VOLTAGE, Drive.ON_BOARD])
def test_a_drive_is_refused_where_it_is_not_announced(host, drive):
    host.arm()
    if announces(host.welcome, drive):
        seen = host.ask(Arm, 1, drive)
        assert is_armed(seen)
        assert bool(seen.status & Status.ON_BOARD) == (drive is Drive.ON_BOARD)
        return
    host.refused(Arm, 0, drive)
    assert is_armed(host.command(host.torque(0.05)))  # it stays as it was
    host.stop()
    host.refused(Arm, 0, drive)
    host.refused(Command, 0.0, 0.0)


def test_a_command_before_arming_is_refused(host):
    host.greet()
    host.refused(Command, 0.0, 0.0)


# Driving


def test_each_command_advances_time_by_a_period(host):
    first = host.arm()
    if not host.is_lockstep:
        pytest.skip("time passes by itself")
    period, share = host.welcome.control_period_us, host.torque(0.025)
    seen = [host.command(share) for _ in range(4)]
    assert [s.period for s in seen] == [1, 2, 3, 4]
    assert [s.time_us - first.time_us for s in seen] == [period * k for k in (1, 2, 3, 4)]
    assert [s.applied for s in seen] == [as_sent(share)] * 4


@pytest.mark.parametrize("share", [50.0, -50.0, 1.025, 1e35])
def test_a_command_beyond_the_limit_is_cut_and_says_so(host, share):
    host.arm()
    seen = host.held(host.torque(share))
    assert seen.applied == as_sent(host.torque(math.copysign(1.0, share)))
    assert seen.status & Status.LIMITED
    assert not host.held(host.torque(0.05)).status & Status.LIMITED


def test_a_difference_gets_no_more_than_is_left(host):
    most = host.greet().difference_limit
    host.ask(Arm, 0)
    seen = host.held(host.torque(0.25), host.torque(50.0))
    assert seen.applied == as_sent(host.torque(0.25))
    assert seen.applied_difference == as_sent(min(most, host.torque(0.75)))
    assert seen.status & Status.LIMITED


@pytest.mark.parametrize("odd", [(math.nan, 0.0), (0.0, math.nan), (math.inf, 0.0), (0.0, -math.inf)])
def test_a_command_that_is_no_number_is_refused_and_the_robot_stays_armed(host, odd):
    host.arm()
    before = host.command(host.torque(0.15))
    host.refused(Command, *odd)
    after = host.held(host.torque(0.15))
    assert is_armed(after)
    assert host.follows(after, before)
    assert after.applied == as_sent(host.torque(0.15))


def test_a_reference_is_refused_where_the_host_drives(host):
    host.arm()
    before = host.command(host.torque(0.15))
    host.refused(Follow, 0.0, 0.0, math.nan, 0.0)
    assert host.follows(host.command(host.torque(0.15)), before)


def test_voltages_are_told_back_and_cut_to_those_of_the_motors(takes_voltages, host):
    host.arm(drive=Drive.VOLTAGE)
    most = host.welcome.voltage_limit
    assert host.held(0.1 * most).applied == as_sent(as_float32(0.1 * most))
    host.refused(Follow, 0.0, 0.0, math.nan, 0.0)
    host.arm(drive=Drive.VOLTAGE)
    seen = host.held(3.0 * most)
    assert seen.applied == as_sent(2.0 * most)  # of both motors
    assert seen.status & Status.LIMITED
    assert host.ask(Arm, 0).status == Status.ARMED
    assert host.held(host.torque(0.05)).applied == as_sent(host.torque(0.05))  # of torques again


def test_a_robot_that_leans_too_far_stops_itself_until_it_is_armed_again(host):
    if not host.is_simulated:
        pytest.skip("no hand leans it")
    seen, most = host.arm(), host.torque(1.0)
    for _ in range(200):
        seen = host.command(-most if seen.tilt > 0 else most)
        if not is_armed(seen):
            break
    assert seen.status == Status.TILT_STOPPED
    after = host.held(most)
    assert (after.status, after.applied) == (Status.TILT_STOPPED, 0.0)
    assert host.follows(after, seen)
    assert is_armed(host.ask(Arm, 0))


# Stop


def test_stop_is_proven_by_telemetry_and_ends_the_rollout(host):
    host.arm()
    host.command(host.torque(0.2))
    seen = host.ask(Stop)
    assert isinstance(seen, Telemetry)
    assert not is_armed(seen)
    host.refused(Command, 0.0, 0.0)
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
    before = host.command(host.torque(0.05))
    host.write(noise)
    after = host.command(host.torque(0.05))
    assert host.follows(after, before)
    assert (after.dropped - before.dropped) % 2**16 == 1
    assert host.since(before) == [before.seq, after.seq]


def test_a_frame_with_any_byte_changed_is_never_obeyed(host):
    host.arm()
    before = host.command(host.torque(0.05))
    frame = to_wire(Command(before.seq + 1, host.torque(0.1), 0.0))
    for place in range(1, len(frame) - 1):
        spoilt = bytearray(frame)
        spoilt[place] ^= 0x41
        host.write(bytes(spoilt))
    host.number += 10
    after = host.command(host.torque(0.05))
    assert host.follows(after, before)
    assert host.since(before) == [before.seq, after.seq]
    assert after.dropped > before.dropped


def test_frames_may_come_byte_by_byte_and_close_together(host):
    host.arm()
    before = host.command(host.torque(0.05))
    numbers = [host.next() for _ in range(3)]
    for byte in b"".join(to_wire(Command(number, host.torque(0.05), 0.0)) for number in numbers):
        host.write(bytes([byte]))
    after = host.wait(lambda m: m.seq == numbers[-1], 0)
    assert host.follows(after, before, 3)
    assert after.dropped == before.dropped


@pytest.mark.parametrize("word", [Telemetry, Fault, Welcome, PoseReport])
def test_a_robots_own_word_is_refused(host, word):
    host.arm()
    before = host.command(host.torque(0.05))
    fields = {
        Telemetry: (0, 0, 1, *[0.0] * 3, 0.0, 0.0),
        Fault: ("no",),
        Welcome: (2, 20_000, 1.0),
        PoseReport: (0, *[0.0] * 4),
    }[word]
    host.refused(word, *fields)
    assert host.follows(host.command(host.torque(0.05)), before)


# Real time


def test_telemetry_streams_each_period_and_the_command_is_held(timed):
    timed.arm()
    share = timed.torque(0.0125)
    began = timed.command(share)
    timed.wait(lambda m: m.period >= began.period + 3)
    seen = [m for m in timed.heard if isinstance(m, Telemetry)]
    assert [s.period for s in seen] == list(range(len(seen)))
    assert np.diff([s.time_us for s in seen]).tolist() == [a_period(timed)] * (len(seen) - 1)
    assert [s.applied for s in seen if s.period > began.period][:3] == [as_sent(share)] * 3
    assert seen[-1].late >= 2


def test_the_watchdog_stops_the_motors_after_a_tenth_of_a_second(timed):
    timed.arm()
    timed.command(timed.torque(0.0125))
    tripped = timed.wait(lambda m: isinstance(m, Telemetry) and not is_armed(m))
    last = [m for m in timed.heard if isinstance(m, Telemetry) and is_armed(m)][-1]
    slack = 0 if timed.is_ours else timed.welcome.control_period_us
    assert last.time_us - last.command_us <= 100_000 + slack
    assert tripped.time_us - tripped.command_us >= 100_000
    assert tripped.time_us - last.time_us == a_period(timed)
    assert tripped.status == Status.WATCHDOG_STOPPED
    assert timed.wait(lambda m: m.period >= tripped.period + 2).applied == 0.0
    timed.say(Command, timed.torque(0.25), 0.0)
    assert not is_armed(timed.wait(lambda m: m.seq == timed.number, 0))
    assert is_armed(timed.ask(Arm, 0))


@pytest.mark.parametrize("how", ["repeated", "outdated", "damaged", "not a number"])
def test_what_is_no_new_and_valid_command_does_not_hold_off_the_watchdog(timed, how):
    timed.arm()
    share = timed.torque(0.0125)
    first = timed.command(share)
    wire = {
        "repeated": lambda: to_wire(Command(first.seq, share, 0.0)),
        "outdated": lambda: to_wire(Command(first.seq - 1, share, 0.0)),
        "damaged": lambda: to_wire(Command(timed.next(), share, 0.0))[:-4],
        "not a number": lambda: to_wire(Command(timed.next(), math.nan, 0.0)),
    }[how]
    seen, deadline = first, time.monotonic() + 20.0
    while is_armed(seen) and time.monotonic() < deadline:
        timed.write(wire())
        seen = timed.wait(lambda m: isinstance(m, Telemetry), timed.heard.index(seen) + 1)
    assert seen.status & Status.WATCHDOG_STOPPED


def test_the_policy_on_board_balances_without_the_host_and_follows_it_again(has_policy, timed):
    first = timed.arm(drive=Drive.ON_BOARD)
    assert first.status & Status.ON_BOARD
    timed.refused(Command, 0.0, 0.0)
    timed.refused(Follow, math.nan, 0.0, 0.0, 0.0)
    timed.refused(Follow, 0.0, 0.0, math.inf, 0.0)
    alone = timed.wait(lambda m: isinstance(m, Telemetry) and m.status & Status.HOST_SILENT, 0)
    assert is_armed(alone)
    assert alone.time_us - alone.command_us >= 100_000
    assert alone.applied != 0.0
    followed = timed.ask(Follow, 0.0, 0.0, math.nan, 0.0, wanted=lambda m: isinstance(m, Telemetry))
    assert is_armed(followed)
    assert not followed.status & Status.HOST_SILENT


def test_after_stop_there_is_silence(timed):
    timed.arm()
    timed.command(timed.torque(0.0125))
    timed.stop()
    timed.silence()  # what was on its way
    assert timed.silence() == []


def test_a_robot_whose_port_was_closed_wants_a_handshake(real_time):
    first = real_time()
    if not first.is_simulated:
        pytest.skip("not every robot can tell that its port was closed")
    first.arm()
    first.close()
    if isinstance(first, MemoryHost):
        second = first  # its line has no ends
    else:
        time.sleep(1.0)  # it looks every 20 ms
        second = real_time()
    assert isinstance(second.ask(Arm, 0), Fault)
    second.close()
