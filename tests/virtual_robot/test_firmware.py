from dataclasses import replace

import pytest

from twbal.core.errors import ConfigError
from twbal.link.decoder import Decoder, to_wire
from twbal.link.protocol import VERSION, Arm, Clock, Command, Fault, Hello, PoseReport, Status, Stop, Telemetry, Welcome
from twbal.link.version_1 import VERSION_1, downgraded, upgraded
from twbal.virtual_robot.firmware import Firmware, Identity

LOCKSTEP = Identity("paper", torque_limit=20.0, tilt_limit=1.0, watchdog=0.1, clock=Clock.LOCKSTEP)
REAL_TIME = replace(LOCKSTEP, clock=Clock.REAL_TIME)
PERIOD_US = 20_000


SPOKEN = [VERSION]  # by host and robot in these tests


@pytest.fixture(params=[VERSION_1, VERSION], autouse=True, ids=lambda version: f"version {version}")
def version(request, monkeypatch):
    """What the robots speak: all tests here are for both versions."""
    for name in ("LOCKSTEP", "REAL_TIME"):
        monkeypatch.setattr(request.module, name, replace(getattr(request.module, name), version=request.param))
    monkeypatch.setattr(request.module, "SPOKEN", [request.param])
    return request.param


def hello(seq):
    return Hello(seq, SPOKEN[0])


def heard(data):
    """What a robot says beside its true poses, in the words of version 2."""
    return [upgraded(message) for message in Decoder().feed(data) if not isinstance(message, PoseReport)]


def spoken(*messages):
    """What a host says that speaks the robot's version."""
    old = SPOKEN == [VERSION_1]
    return b"".join(to_wire(downgraded(message) if old else message) for message in messages)


def tell(firmware, *messages, now_us=0):
    return heard(firmware.receive(spoken(*messages), now_us))


def armed(plant, identity, now_us=0):
    firmware = Firmware(plant, identity)
    tell(firmware, hello(1), Arm(2, 0), now_us=now_us)
    return firmware


def session(plant, trial):
    """The bytes of one rollout in lockstep."""
    firmware = Firmware(plant, LOCKSTEP)
    words = [hello(1), Arm(2, trial), *(Command(3 + k, (-1.0) ** k) for k in range(30)), Stop(40)]
    return b"".join(firmware.receive(spoken(word), 0) for word in words)


def test_the_handshake_says_who_it_is(sim_plant, version):
    (said,) = tell(Firmware(sim_plant, LOCKSTEP), hello(4))
    assert (said.seq, said.version, said.control_period_us, said.torque_limit) == (4, version, 20_000, 20.0)
    assert (said.clock, said.name, said.difference_limit) == (Clock.LOCKSTEP, "paper", 0.0)


@pytest.mark.parametrize("word", [Arm(2, 0), Command(2, 1.0), Stop(2)])
@pytest.mark.parametrize("first", [None, Hello(1, VERSION + 1)])
def test_nothing_is_obeyed_before_a_handshake_of_this_version(sim_plant, word, first, version):
    firmware = Firmware(sim_plant, LOCKSTEP)
    if first is not None:
        (welcome,) = tell(firmware, first)
        assert welcome.version == version
    assert tell(firmware, word) == [Fault(2, "no handshake of this version yet; begin with Hello")]


def test_the_same_trial_is_the_same_bytes_and_another_is_not(sim_plant):
    first, other, again = (session(sim_plant, trial) for trial in (3, 4, 3))
    assert first == again != other


def test_each_command_advances_the_clock_by_one_period_in_lockstep(sim_plant):
    firmware = armed(sim_plant, LOCKSTEP)
    seen = tell(firmware, *(Command(3 + k, 0.5) for k in range(5)))
    assert [(s.seq, s.period, s.time_us) for s in seen] == [(3 + k, 1 + k, PERIOD_US * (1 + k)) for k in range(5)]
    assert firmware.next_tick_us is None
    assert firmware.advance(10**12) == b""


def test_a_repeated_command_acts_once_and_is_answered_again(sim_plant):
    firmware = armed(sim_plant, LOCKSTEP)
    first = tell(firmware, Command(3, 5.0))
    assert tell(firmware, Command(3, 5.0), Command(3, 5.0)) == first * 2
    assert tell(firmware, Command(4, 5.0))[0].period == 2


def test_the_motors_are_off_before_arming_and_after_a_stop(sim_plant):
    firmware = Firmware(sim_plant, LOCKSTEP)
    off = "the motors are off; begin with Arm"
    assert tell(firmware, hello(1), Command(2, 1.0))[-1] == Fault(2, off)
    *_, stopped, refused = tell(firmware, Arm(3, 0), Command(4, 1.0), Stop(5), Command(6, 1.0))
    assert isinstance(stopped, Telemetry)
    assert stopped.status == Status(0)
    assert refused == Fault(6, off)


def test_a_hello_in_the_middle_disarms(sim_plant):
    firmware = armed(sim_plant, LOCKSTEP)
    assert isinstance(tell(firmware, hello(3), Command(4, 1.0))[-1], Fault)


def test_a_torque_that_is_no_number_is_refused_and_the_one_before_stays(sim_plant):
    firmware = armed(sim_plant, LOCKSTEP)
    (refused,) = tell(firmware, Command(3, float("nan")))
    assert "not a finite number" in refused.text
    (seen,) = tell(firmware, Command(4, 1.0))
    assert seen.period == 1


def test_a_robots_word_from_a_host_is_refused(sim_plant):
    (refused,) = tell(armed(sim_plant, LOCKSTEP), PoseReport(9, 1, *[0.0] * 4))
    assert "robot's word" in refused.text


def test_beyond_its_tilt_limit_it_stops_itself_and_goes_on_measuring(sim_plant):
    firmware = armed(sim_plant, replace(LOCKSTEP, tilt_limit=0.3))
    seen = [tell(firmware, Command(3 + k, 20.0))[0] for k in range(30)]  # forward drive tips it over backwards
    trip = next(k for k, s in enumerate(seen) if abs(s.tilt) > 0.3)
    assert [s.status for s in seen[:trip]] == [Status.ARMED] * trip
    assert {s.status for s in seen[trip:]} == {Status.TILT_STOPPED}
    assert seen[-1].period == 30
    assert seen[-1].wheel_angle != seen[trip].wheel_angle


def test_real_time_streams_once_a_period_with_the_torque_commanded_last(sim_plant):
    start = 123_456
    firmware = armed(sim_plant, REAL_TIME, now_us=start)
    assert firmware.next_tick_us == start + PERIOD_US
    assert firmware.advance(start + PERIOD_US - 1) == b""
    assert tell(firmware, Command(3, 5.0), now_us=start + 1000) == []
    seen = heard(firmware.advance(start + 2 * PERIOD_US))
    assert [(s.seq, s.period, s.time_us) for s in seen] == [(3, k, start + k * PERIOD_US) for k in (1, 2)]

    other = armed(sim_plant, LOCKSTEP)
    assert [s.tilt for s in tell(other, Command(3, 5.0), Command(4, 5.0))] == [s.tilt for s in seen]


def test_without_commands_the_watchdog_stops_it_after_its_time(sim_plant):
    firmware = armed(sim_plant, REAL_TIME)
    tell(firmware, Command(3, 5.0), now_us=30_000)
    seen = heard(firmware.advance(200_000))
    assert [s.status for s in seen] == [Status.ARMED] * 6 + [Status.WATCHDOG_STOPPED] * 4  # runs out at 130 ms
    tell(firmware, Command(4, 5.0), now_us=200_000)
    (late,) = heard(firmware.advance(220_000))
    assert late.status == Status.WATCHDOG_STOPPED
    (fresh,) = tell(firmware, Arm(5, 0), now_us=220_000)
    assert fresh.status == Status.ARMED


def test_regular_commands_hold_the_watchdog_off(sim_plant):
    firmware = armed(sim_plant, REAL_TIME)
    for k in range(20):
        tell(firmware, Command(3 + k, 0.0), now_us=90_000 * k)
        seen = heard(firmware.advance(90_000 * k))
        assert all(not s.status & Status.WATCHDOG_STOPPED for s in seen)


def test_a_host_that_only_repeats_itself_does_not_hold_the_watchdog_off(sim_plant):
    firmware = armed(sim_plant, REAL_TIME)
    for k in range(10):
        tell(firmware, Command(3, 5.0), now_us=50_000 * k)
    seen = heard(firmware.advance(500_000))
    assert [s.status for s in seen[:6]] == [Status.ARMED] * 5 + [Status.WATCHDOG_STOPPED]


def test_a_host_that_has_gone_leaves_a_robot_without_torque(sim_plant):
    firmware = armed(sim_plant, REAL_TIME)
    tell(firmware, Command(3, 5.0))
    firmware.host_gone()
    assert firmware.next_tick_us is None
    assert firmware.advance(10**9) == b""
    assert isinstance(tell(firmware, Command(4, 1.0))[0], Fault)


# What docs/protocol.md says of the robot's side


@pytest.mark.parametrize("name", ["torque_limit", "tilt_limit", "watchdog"])
@pytest.mark.parametrize("value", [float("nan"), float("inf"), 0.0, -1.0])
def test_a_limit_that_would_never_stop_the_robot_is_refused(name, value):
    with pytest.raises(ConfigError, match=f"{name} of a robot must be positive and finite; found"):
        replace(LOCKSTEP, **{name: value})


def test_a_robot_that_has_stopped_itself_takes_commands_and_does_not_follow_them(sim_plant):
    torques = []
    sim_step, sim_plant.step = sim_plant.step, lambda torque: torques.append(torque) or sim_step(torque)
    firmware = armed(sim_plant, replace(LOCKSTEP, tilt_limit=0.01))  # it starts at 10°
    seen = tell(firmware, Command(3, 20.0), Command(4, -20.0))
    assert [(s.seq, s.period, s.status) for s in seen] == [(3, 1, Status.TILT_STOPPED), (4, 2, Status.TILT_STOPPED)]
    assert torques == [0.0, 0.0]


def test_in_lockstep_a_robot_that_has_stopped_itself_answers_each_command_and_is_else_silent(sim_plant):
    firmware = armed(sim_plant, replace(LOCKSTEP, tilt_limit=0.01))
    assert firmware.next_tick_us is None
    assert firmware.advance(10**12) == b""
    assert len(tell(firmware, Command(3, 0.0))) == 1


def test_in_real_time_a_robot_that_has_stopped_itself_streams_until_it_is_told_to_stop(sim_plant):
    firmware = armed(sim_plant, replace(REAL_TIME, tilt_limit=0.01))
    assert [s.status for s in heard(firmware.advance(3 * PERIOD_US))] == [Status.TILT_STOPPED] * 3
    (stopped,) = tell(firmware, Stop(3), now_us=3 * PERIOD_US)
    assert stopped.status == Status(0)
    assert firmware.advance(10**12) == b""


@pytest.mark.parametrize("word", [Command(3, -20.0), Arm(3, 9), Stop(3)])
def test_the_number_alone_makes_a_repetition(sim_plant, word):
    firmware = armed(sim_plant, LOCKSTEP)
    first = tell(firmware, Command(3, 5.0))
    assert tell(firmware, word) == first
    assert tell(firmware, Command(4, 5.0))[0].period == 2


def test_a_repeated_arming_does_not_begin_anew(sim_plant):
    firmware = Firmware(sim_plant, LOCKSTEP)
    _, first = tell(firmware, hello(1), Arm(2, 0))
    assert tell(firmware, Arm(2, 0)) == [first]


def test_a_repeated_refusal_is_refused_again(sim_plant):
    firmware = Firmware(sim_plant, LOCKSTEP)
    _, refused = tell(firmware, hello(1), Command(2, 1.0))
    assert tell(firmware, Command(2, 1.0)) == [refused]


def test_a_repeated_hello_is_obeyed_each_time(sim_plant):
    firmware = armed(sim_plant, LOCKSTEP)
    tell(firmware, Command(3, 5.0))
    welcome, refused = tell(firmware, hello(3), Command(4, 5.0))
    assert isinstance(welcome, Welcome)
    assert isinstance(refused, Fault)


def driven_with_torque(robot, times_us, firmware):
    """How long the motors had their torque [s], and what was heard; the robot has neither delay nor lag."""
    heard_of, seconds, begun = [], 0.0, 0
    for now_us in times_us:
        heard_of += heard(firmware.advance(now_us))
        seconds += (now_us - begun) * 1e-6 * float(robot._memory.torque.sum() > 0.0)
        begun = now_us
    return seconds, heard_of


def test_a_command_late_in_a_period_carries_its_number_at_the_end_and_acts_for_what_is_left(make):
    robot = make()
    late = armed(robot, REAL_TIME)
    tell(late, Command(3, 5.0), now_us=3 * PERIOD_US // 4)
    seconds, (seen,) = driven_with_torque(robot, range(3 * PERIOD_US // 4, PERIOD_US + 1, 250), late)
    assert (seen.seq, seen.period) == (3, 1)
    assert seconds == pytest.approx(0.25 * PERIOD_US * 1e-6, abs=0.0003)


@pytest.mark.parametrize("step_us", [1000, 130_000, 200_000])
def test_the_watchdog_takes_the_torque_away_at_its_time_however_seldom_the_robot_looks(step_us, make):
    robot = make(start=0.02)
    firmware = armed(robot, replace(REAL_TIME, tilt_limit=3.0))
    tell(firmware, Command(3, 5.0), now_us=5000)
    (stopped,) = [s for s in heard(by_steps(firmware, 120_000, step_us)) if s.status][-1:]
    assert stopped.status == Status.WATCHDOG_STOPPED
    other = make(start=0.02)  # 5 N·m from 5 ms to 105 ms
    other.reset(0)
    other.drive_until(0.005, 0.0)
    for _ in range(5):
        seen = other.step(5.0)
    other.drive_until(0.005, 5.0)
    seen = other.step(0.0)
    assert stopped.wheel_angle == pytest.approx(seen.wheel_angle, rel=1e-6)


def by_steps(firmware, until_us, step_us):
    """What it says until a time, looked at so often."""
    times = [*range(step_us, until_us, step_us), until_us]
    return b"".join(firmware.advance(now_us) for now_us in times)


def test_a_plant_that_cannot_be_driven_in_parts_is_driven_by_whole_periods(sim_plant):
    late = armed(sim_plant, REAL_TIME)
    tell(late, Command(3, 5.0), now_us=PERIOD_US - 1)
    (seen,) = heard(late.advance(PERIOD_US))
    (punctual,) = tell(armed(sim_plant, LOCKSTEP), Command(3, 5.0))
    assert seen.tilt == punctual.tilt


def test_the_count_of_periods_overflows_to_zero(sim_plant):
    seen = sim_plant.reset(0)
    sim_plant.step = lambda torque: seen
    firmware = armed(sim_plant, REAL_TIME)
    firmware._period = 2**16 - 3
    counts = [s.period for s in heard(firmware.advance(PERIOD_US * 4))]
    assert counts == [2**16 - 2, 2**16 - 1, 0, 1]


# The true pose


def said_with(firmware, *messages):
    """All that a robot says, poses too."""
    return [upgraded(word) for word in Decoder().feed(firmware.receive(spoken(*messages), 0))]


def test_each_telemetry_of_a_moving_robot_follows_its_true_pose(sim_plant):
    firmware, poses = armed(sim_plant, LOCKSTEP), []
    for k in range(20):
        pose, seen = said_with(firmware, Command(3 + k, 2.0))
        assert (type(pose), type(seen)) == (PoseReport, Telemetry)
        assert (pose.seq, pose.period) == (seen.seq, seen.period) == (3 + k, 1 + k)
        assert (pose.x, pose.y, pose.heading, pose.tilt) == pytest.approx(sim_plant.pose(), abs=1e-6)
        poses.append(pose.x)
    assert poses[-1] > 0.01


def test_in_real_time_poses_are_streamed_with_the_telemetry(sim_plant):
    firmware = armed(sim_plant, REAL_TIME)
    said = [upgraded(word) for word in Decoder().feed(firmware.advance(3 * PERIOD_US))]
    assert [type(word) for word in said] == [PoseReport, Telemetry] * 3
    assert [word.period for word in said] == [1, 1, 2, 2, 3, 3]


def test_a_robot_at_rest_or_without_a_pose_says_none(sim_plant):
    assert [type(word) for word in said_with(armed(sim_plant, LOCKSTEP), Stop(3))] == [Telemetry]
    sim_plant.pose = lambda: None
    assert [type(word) for word in said_with(armed(sim_plant, LOCKSTEP), Command(3, 0.0))] == [Telemetry]


def test_a_repeated_command_is_answered_with_the_same_pose(sim_plant):
    firmware = armed(sim_plant, LOCKSTEP)
    assert said_with(firmware, Command(3, 5.0)) == said_with(firmware, Command(3, 5.0))
