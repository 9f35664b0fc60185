import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from pendulum import MemoryTransport, Pendulum

from twbal.algorithm.rollout import rollout
from twbal.core.channels import Channels
from twbal.core.episode import Outcome, Provenance
from twbal.core.errors import DataError, LinkError, LinkLostError, ProtocolError
from twbal.core.plant import Pose
from twbal.link.decoder import Decoder, to_wire
from twbal.link.protocol import VERSION, Clock, Command, PoseReport, Sensors, Status, Stop, Telemetry, Welcome
from twbal.link.serial_plant import SerialPlant
from twbal.link.version_1 import VERSION_1, downgraded, upgraded
from twbal.policies.policy import Policy
from twbal.virtual_robot.firmware import Firmware, Identity

CHANNELS = Channels(("tilt", "tilt_rate"), wheel_radius=0.15)
LOCKSTEP = Identity("pendulum", torque_limit=20.0, tilt_limit=1.0, watchdog=0.1, clock=Clock.LOCKSTEP)
REAL_TIME = replace(LOCKSTEP, clock=Clock.REAL_TIME)
CATCH = 30.0, 8.0


@pytest.fixture(params=[VERSION_1, VERSION], autouse=True, ids=lambda version: f"version {version}")
def version(request, monkeypatch):
    """What the robots speak: all tests here are for both versions."""
    for name in ("LOCKSTEP", "REAL_TIME"):
        monkeypatch.setattr(request.module, name, replace(getattr(request.module, name), version=request.param))
    return request.param


class Linear(Policy):
    """u = k · x, and whatever `trap` does at each step."""

    def __init__(self, trap=lambda step: None):
        self.trap = trap

    def controller(self, rng):
        steps = iter(range(10**9))

        def law(state):
            self.trap(next(steps))
            return float(np.dot(CATCH, state))

        return law


def linked(identity=None, timeout=0.5, **line):
    pendulum = Pendulum()
    transport = MemoryTransport(Firmware(pendulum, identity or LOCKSTEP), **line)
    return SerialPlant(transport, timeout, timeout, timeout), transport, pendulum


def drive(plant, steps=40, policy=None, trial=0):
    return rollout(
        plant, policy or Linear(), CHANNELS, steps, math.radians(30), Provenance("pendulum", "robot", trial=trial)
    )


def heard(data):
    """What a robot says, in the words of version 2, which a host of that version takes in any session."""
    return map(upgraded, Decoder().feed(data))


def silent(data):
    return b""


def test_a_rollout_over_the_line_is_the_rollout_without_it():
    direct = drive(Pendulum())
    linked_episode = drive(linked()[0])
    assert linked_episode.outcome is direct.outcome is Outcome.COMPLETED
    np.testing.assert_allclose(linked_episode.observations, direct.observations, atol=1e-6)
    np.testing.assert_allclose(linked_episode.commands, direct.commands, atol=1e-4)


def test_the_handshake_tells_the_robot_and_its_limits():
    plant, _, _ = linked(REAL_TIME)
    assert (plant.robot_name, plant.torque_limit, plant.control_period, plant.clock) == (
        "pendulum",
        20.0,
        0.02,
        Clock.REAL_TIME,
    )


def test_another_protocol_version_is_an_error_that_names_both():
    class FutureRobot(MemoryTransport):
        def write(self, data):
            self._waiting += to_wire(Welcome(1, 7))

    line = FutureRobot(Firmware(Pendulum(), LOCKSTEP))
    with pytest.raises(ProtocolError, match=r"version 7 .* this twbal versions 1 and 2"):
        SerialPlant(line, 0.5, 0.5, 0.5)
    assert line.closed


@pytest.mark.parametrize("broken", [{"control_period_us": 0}, {"torque_limit": 0.0}, {"torque_limit": math.nan}])
def test_a_robot_that_announces_nonsense_is_refused(broken):
    class OddRobot(MemoryTransport):
        def write(self, data):
            (said,) = Decoder().feed(self.firmware.receive(data, 0))
            self._waiting += to_wire(replace(said, **broken))

    with pytest.raises(ProtocolError, match="announces what cannot be"):
        SerialPlant(OddRobot(Firmware(Pendulum(), LOCKSTEP)), 0.5, 0.5, 0.5)


@pytest.mark.parametrize("clock", [Clock.LOCKSTEP, Clock.REAL_TIME])
@pytest.mark.parametrize("period", [0.08, 0.0801, 1.0])
def test_a_control_period_that_the_watchdog_does_not_allow_is_refused_in_real_time(clock, period):
    slow = Pendulum()
    slow.control_period = period
    line = MemoryTransport(Firmware(slow, replace(LOCKSTEP, clock=clock)))
    if clock is Clock.LOCKSTEP or period == 0.08:
        assert SerialPlant(line, 0.5, 0.5, 0.5).control_period == pytest.approx(period)
        return
    with pytest.raises(ProtocolError, match=r"of \d+ µs in real time \(expected at most 80000: .* 100 ms after"):
        SerialPlant(line, 0.5, 0.5, 0.5)


def test_a_robot_that_does_not_answer_is_an_error():
    line = MemoryTransport(Firmware(Pendulum(), LOCKSTEP))
    line.to_host = silent
    with pytest.raises(LinkError, match=r"No answer to Hello .* memory within 0\.06 s"):
        SerialPlant(line, 0.06, 0.06, 0.06)
    assert line.closed


@pytest.mark.parametrize("said", [b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M\r\n", bytes(range(256))])
def test_another_device_on_the_port_is_told_from_a_robot_that_is_silent(said):
    line = MemoryTransport(Firmware(Pendulum(), LOCKSTEP))
    line.to_host = lambda data: said
    with pytest.raises(LinkError, match=r"No answer to Hello .* bytes came, but not from a twbal robot"):
        SerialPlant(line, 0.06, 0.06, 0.06)


def test_noise_on_the_line_changes_nothing_in_lockstep():
    rng = np.random.default_rng(3)
    plant, line, _ = linked(timeout=30.0)

    def spoil(data):
        spoilt = bytearray(data)
        if spoilt and rng.random() < 0.1:
            spoilt[rng.integers(len(spoilt))] ^= 1 << rng.integers(8)
        return rng.bytes(int(rng.integers(0, 9))) + bytes(spoilt)

    line.to_robot = line.to_host = spoil
    noisy, clean = drive(plant), drive(linked()[0])
    assert plant.bad_frames > 5
    np.testing.assert_array_equal(noisy.observations, clean.observations)


def test_a_robot_that_falls_silent_leaves_the_episode_so_far():
    plant, line, _ = linked(timeout=0.06)

    def cut(step):
        if step == 7:
            line.to_host = silent

    episode = drive(plant, policy=Linear(cut))
    assert episode.outcome is Outcome.LINK_LOST
    assert len(episode) == 7
    assert "No answer to Command" in episode.events[0].text
    assert "does not confirm that its motors are off" in episode.events[1].text
    with pytest.raises(LinkError, match="No answer to Hello"):
        plant.reset(1)


def test_a_link_that_comes_back_serves_the_next_rollout():
    plant, line, _ = linked(timeout=0.06)

    def cut(step):
        if step == 7:
            line.to_host = silent

    drive(plant, policy=Linear(cut))
    line.to_host = bytes
    assert drive(plant, trial=1).outcome is Outcome.COMPLETED


@pytest.mark.parametrize(
    ("trouble", "outcome"), [(KeyboardInterrupt, Outcome.STOPPED), (ZeroDivisionError, Outcome.POLICY_FAULT)]
)
def test_the_robot_is_disarmed_on_every_way_out(trouble, outcome):
    plant, _, pendulum = linked()

    def fail(step):
        if step == 5:
            raise trouble

    episode = drive(plant, policy=Linear(fail))
    assert (len(episode), episode.outcome) == (5, outcome)
    assert len(pendulum.torques) == 6
    assert pendulum.torques[-1] is None


def test_a_stop_that_is_cut_short_by_ctrl_c_is_sent_again_on_closing():
    plant, line, pendulum = linked()
    plant.reset(0)
    plant.step(1.0)

    def press(data):
        line.to_robot = bytes
        raise KeyboardInterrupt

    line.to_robot = press
    with pytest.raises(KeyboardInterrupt):
        plant.stop()
    assert pendulum.torques == [1.0]
    plant.close()
    assert pendulum.torques == [1.0, None]


@pytest.mark.parametrize("name", ["tilt", "wheel_angle", "yaw_rate"])
def test_a_value_that_is_no_number_ends_the_rollout_and_keeps_the_episode_so_far(name):
    plant, line, pendulum = linked()

    def spoil(data):
        return b"".join(to_wire(replace(seen, **{name: math.nan})) for seen in heard(data))

    def break_sensor(step):
        if step == 7:
            line.to_host = spoil

    episode = drive(plant, policy=Linear(break_sensor))
    assert (len(episode), episode.outcome) == (7, Outcome.LINK_LOST)
    assert f"not finite numbers ({name})" in episode.events[-1].text
    assert pendulum.torques[-1] is None


def test_a_robot_that_was_switched_off_at_its_own_side_in_mid_period_ends_the_rollout():
    plant, line, _ = linked()
    plant.reset(0)

    def off(data):
        return b"".join(to_wire(replace(seen, status=Status(0))) for seen in heard(data))

    line.to_host = off
    with pytest.raises(LinkLostError, match="stopped at its own side"):
        plant.step(0.0)


def test_leaving_the_plant_disarms_and_closes():
    plant, line, pendulum = linked()
    with plant:
        plant.reset(0)
        plant.step(1.0)
    plant.close()
    assert pendulum.torques == [1.0, None]
    assert line.closed


def test_a_plant_that_was_closed_says_so_and_nothing_of_its_motors():
    plant, _, pendulum = linked()
    with plant:
        plant.reset(0)
    for use in (lambda: plant.reset(1), lambda: plant.step(1.0), plant.check_open, lambda: drive(plant)):
        with pytest.raises(LinkError, match=r"This plant was closed, .*Connect anew") as caught:
            use()
        assert not isinstance(caught.value, LinkLostError)
    plant.stop()
    assert pendulum.torques == [None]


def test_commands_are_clipped_to_the_announced_limit_and_that_is_noted():
    plant, _, pendulum = linked()
    plant.reset(0)
    plant.step(19.0)
    plant.step(-25.0)
    assert pendulum.torques == [19.0, -20.0]
    assert [e.text for e in plant.events] == ["command of -25 N·m clipped to the robot's limit of 20 N·m"]


def test_the_episode_has_the_commands_that_were_sent_also_of_a_policy_without_a_limit():
    plant, _, pendulum = linked(replace(LOCKSTEP, torque_limit=0.7))
    episode = drive(plant)
    assert plant.command_limit == pytest.approx(0.7)
    assert any("clipped" in event.text for event in plant.events)
    np.testing.assert_allclose(episode.commands, [torque for torque in pendulum.torques if torque is not None])


def test_a_command_that_is_no_number_is_refused_before_it_is_sent():
    plant, _, pendulum = linked()
    plant.reset(0)
    with pytest.raises(DataError, match="not a finite number"):
        plant.step(math.nan)
    assert pendulum.torques == []


def test_the_robot_is_placed_before_it_is_armed():
    seen = []
    pendulum = Pendulum()
    line = MemoryTransport(Firmware(pendulum, LOCKSTEP))
    plant = SerialPlant(
        line, 0.5, 0.5, 0.5, lambda trial: seen.append((trial, line.firmware.next_tick_us, pendulum.torques))
    )
    plant.reset(4)
    assert seen == [(4, None, [])]


def test_a_robot_that_lies_on_the_floor_does_not_arm():
    with pytest.raises(LinkError, match=r"does not arm: its tilt of -\d+° is beyond its own limit"):
        linked(replace(LOCKSTEP, tilt_limit=0.01))[0].reset(0)


def test_a_robot_that_stopped_itself_is_not_driven_on():
    plant, _, pendulum = linked(replace(LOCKSTEP, tilt_limit=0.25))
    seen = plant.reset(0)
    while abs(seen.tilt) <= 0.25:
        seen = plant.step(0.0)
    with pytest.raises(LinkLostError, match="beyond its own limit"):
        plant.step(0.0)
    episode = drive(plant, policy=Linear(), trial=0)
    assert episode.outcome is Outcome.COMPLETED
    assert pendulum.torques[-1] is None


def test_stepping_without_a_reset_is_an_error():
    with pytest.raises(LinkLostError, match="never reset"):
        linked()[0].step(0.0)


def test_a_robot_that_restarts_ends_the_rollout_with_its_own_words_and_can_be_used_again():
    plant, line, _ = linked()

    def restart(step):
        if step == 3:
            line.firmware.host_gone()

    episode = drive(plant, policy=Linear(restart))
    assert (len(episode), episode.outcome) == (3, Outcome.LINK_LOST)
    assert "no handshake" in episode.events[-1].text
    assert drive(plant, trial=1).outcome is Outcome.COMPLETED


def test_time_counts_from_the_rollouts_start_across_the_clocks_overflow():
    plant, _, _ = linked(REAL_TIME, us_per_read=1000, now_us=2**32 - 50_000)
    times = [plant.reset(0).time, *(plant.step(0.0).time for _ in range(5))]
    np.testing.assert_allclose(times, 0.02 * np.arange(6), atol=1e-9)


def test_in_real_time_a_punctual_host_drives_as_in_lockstep():
    plant, _, _ = linked(REAL_TIME, us_per_read=1000)
    np.testing.assert_array_equal(drive(plant).observations, drive(linked()[0]).observations)
    assert plant.missed_periods == 0


def without_each(count, kind):
    """Loses each so many-th message of a kind, as it is sent first."""
    met = []

    def way(data):
        (message,) = heard(data)
        if type(message) is not kind or message.seq in met:
            return data
        met.append(message.seq)
        return data if len(met) % count else b""

    return way


def test_a_command_that_was_lost_is_sent_again_as_soon_as_telemetry_lacks_it():
    """The robot's clock runs far ahead of the host's here: who waits 50 ms of the host's is stopped by the watchdog."""
    plant, line, pendulum = linked(REAL_TIME, us_per_read=1000)
    line.to_robot = without_each(10, Command)
    episode = drive(plant)
    assert episode.outcome is Outcome.COMPLETED
    assert plant.missed_periods == 4
    assert [event.text for event in plant.events] == 4 * [
        "1 control periods passed without a command in time",
        "a command was sent again, 1 times, before it was answered",
    ]
    assert pendulum.torques[9] == pendulum.torques[8]  # the command before was held for a period


def test_messages_that_are_damaged_or_sent_again_are_noted_in_the_episode():
    plant, line, _ = linked(timeout=30.0)
    spoilt = iter([False, False, True, True, *[False] * 99])
    line.to_host = lambda data: data[:10] + b"?" + data[11:] if data and next(spoilt) else data
    plant.reset(0)
    plant.step(0.0)
    assert plant.events == ()
    plant.step(0.0)
    assert [event.text for event in plant.events] == [
        "2 damaged frames came from the robot",
        "a command was sent again, 2 times, before it was answered",
    ]
    plant.step(0.0)
    assert len(plant.events) == 2
    plant.reset(1)
    assert plant.events == ()


def test_an_answer_that_is_late_is_no_message_lost():
    """How long a computer takes for a period must not show in the episode of a robot in lockstep."""
    plant, line, _ = linked(timeout=30.0)
    punctual = drive(plant, steps=5)
    waiting = [b""]

    def later(data):
        waiting.append(data)
        return waiting.pop(0)

    line.to_host = later  # each answer comes when the host sends the next time: again, or the next command
    late = drive(plant, steps=5)
    np.testing.assert_array_equal(late.observations, punctual.observations)
    plant.stop()
    assert plant.events == ()
    answers = itertools.count()
    line.to_host = lambda data: b"" if next(answers) == 2 else data
    drive(plant, steps=5)
    assert [event.text for event in plant.events] == ["a command was sent again, 1 times, before it was answered"]


def test_in_real_time_a_late_host_misses_periods_and_they_are_counted():
    plant, line, pendulum = linked(REAL_TIME, us_per_read=1000)
    plant.reset(0)
    plant.step(1.0)
    line.pass_time(50_000)  # two and a half control periods
    seen = plant.step(2.0)
    assert pendulum.torques == [1.0, 1.0, 1.0, 2.0]
    assert plant.missed_periods == 2
    assert plant.events[0].text == "2 control periods passed without a command in time"
    assert seen.time == pytest.approx(0.08)


def test_a_host_later_than_the_watchdog_has_lost_the_robot():
    plant, line, pendulum = linked(REAL_TIME, us_per_read=1000)
    plant.reset(0)
    plant.step(1.0)
    line.pass_time(200_000)
    late = r"watchdog\). By its clock 2[0-4]\d ms passed .* the host was late: close other programs"
    with pytest.raises(LinkLostError, match=late):
        plant.step(1.0)
    assert pendulum.torques[-1] == 0.0


def test_a_stop_without_an_answer_is_a_lost_link_and_does_not_cost_the_episode():
    plant, line, _ = linked(timeout=0.06)
    line.to_robot = lambda data: b"" if isinstance(Decoder().feed(data)[0], Stop) else data
    episode = drive(plant, steps=20)
    assert (len(episode), episode.outcome) == (20, Outcome.LINK_LOST)
    assert "does not confirm that its motors are off" in episode.events[-1].text
    assert "No answer to Stop" in episode.events[-1].text


def test_what_both_wheels_say_is_averaged_and_their_difference_is_kept():
    plant, line, _ = linked()

    def turning(data):
        wheels = {"wheel_left": 1.0, "wheel_right": 3.0, "rate_left": -1.0, "rate_right": 2.0}
        return b"".join(to_wire(replace(downgraded(seen), **wheels)) for seen in heard(data))

    line.to_host = turning
    plant.sensors |= Sensors.WHEEL_DIFFERENCE
    plant.sensors &= ~Sensors.DIFFERENCE_RATE
    seen = plant.reset(0)
    assert (seen.wheel_angle, seen.wheel_rate) == (2.0, 0.5)
    assert plant.wheel_difference().angle == 2.0
    assert np.isnan(plant.wheel_difference().rate)
    plant.sensors |= Sensors.DIFFERENCE_RATE
    assert plant.wheel_difference() == (2.0, 3.0)


# The true pose


class Watched(Pendulum):
    """A pendulum that cameras see: it goes ahead by a quarter of a metre in each period, and is told as `tell` says."""

    def __init__(self, tell=lambda pose: pose):
        super().__init__()
        self.tell = tell

    def pose(self):
        ahead = 0.25 * sum(torque is not None for torque in self.torques)
        return self.tell(Pose(ahead, -0.5 * ahead, 0.125, self._tilt))


def watched(identity=None, tell=lambda pose: pose, **line):
    pendulum = Watched(tell)
    transport = MemoryTransport(Firmware(pendulum, identity or LOCKSTEP), **line)
    return SerialPlant(transport, 0.5, 0.5, 0.5), transport


def test_poses_come_over_the_line_and_into_the_episode():
    plant, _ = watched()
    episode = drive(plant, steps=10)
    np.testing.assert_array_equal(episode.poses[:, 0], 0.25 * np.arange(11))
    np.testing.assert_array_equal(episode.poses[:, 1:3], np.column_stack([-0.125 * np.arange(11), np.full(11, 0.125)]))
    np.testing.assert_allclose(episode.poses[:, 3], episode.tilt, atol=1e-6)


def test_a_robot_that_says_no_pose_has_none():
    plant, _, _ = linked()
    assert drive(plant).poses is None
    assert plant.pose() is None


def test_in_real_time_the_pose_is_that_of_the_newest_telemetry():
    plant, line = watched(REAL_TIME, us_per_read=7_000)
    plant.reset(0)
    plant.step(1.0)
    line.pass_time(60_000)
    plant.step(1.0)
    assert plant.missed_periods >= 2
    assert plant.pose().x == 0.25 * (plant.missed_periods + 2)


@pytest.mark.parametrize("lost", [PoseReport, None])
def test_a_pose_that_is_lost_is_unknown_at_that_instant_and_is_not_taken_from_another(lost):
    """A line that loses the third frame of that kind; where it loses none, all poses are known."""
    plant, line = watched()
    count = iter(range(10**9))

    def lossy(data):
        words = heard(data)
        return b"".join(to_wire(w) for w in words if not (lost and isinstance(w, lost) and next(count) == 2))

    line.to_host = lossy
    episode = drive(plant, steps=6)
    unknown = np.isnan(episode.poses).all(axis=1)
    assert unknown.tolist() == [lost is not None and k == 2 for k in range(7)]
    np.testing.assert_array_equal(episode.poses[~unknown, 0], 0.25 * np.arange(7)[~unknown])


def test_a_pose_of_a_telemetry_that_was_lost_is_not_given_to_the_next():
    plant, line = watched(REAL_TIME, us_per_read=20_000)
    plant.reset(0)

    def without(kind, data):
        return b"".join(to_wire(w) for w in heard(data) if not isinstance(w, kind))

    line.to_host = lambda data: without(Telemetry, data)
    line.pass_time(40_000)
    line.to_host = lambda data: without(PoseReport, data)
    plant.step(0.0)
    assert plant.pose() is None


@pytest.mark.parametrize(
    ("broken", "said"),
    [
        ({"x": math.nan}, r"not finite numbers \(x\)"),
        ({"y": math.inf}, r"not finite numbers \(y\)"),
        ({"heading": 2e4}, "heading 2e\\+04 rad"),
        ({"x": -2e5, "tilt": 20.0}, "x -2e\\+05 m.*tilt 20 rad"),
    ],
)
def test_a_pose_that_cannot_be_ends_the_rollout_as_telemetry_does_that_cannot_be(broken, said):
    plant, _ = watched(tell=lambda pose: pose._replace(**broken) if pose.x == 0.5 else pose)
    episode = drive(plant, steps=6)
    assert episode.outcome is Outcome.LINK_LOST
    assert len(episode) == 1
    with pytest.raises(LinkLostError, match=f"sends a pose with values.*{said}"):
        plant.reset(0), plant.step(0.0), plant.step(0.0)
