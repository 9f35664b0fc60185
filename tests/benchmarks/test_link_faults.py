"""The campaign of faults: its faults do what they say, its judge finds what is wrong, and a few are ridden out."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from random import Random

import numpy as np
import pytest

from benchmarks.link_faults.__main__ import settings_of
from benchmarks.link_faults.disturbances import (
    Frames,
    OtherClock,
    WithoutStop,
    corrupted,
    doubled,
    dropped,
    swapped,
)
from benchmarks.link_faults.frames import Cutter, Said, framed, payload_of, said_in, total_in
from benchmarks.link_faults.judging import judged, lateness, off_ms
from benchmarks.link_faults.kinds import kinds
from benchmarks.link_faults.line import Passed
from benchmarks.link_faults.tables import link_fault_misses, link_faults
from benchmarks.link_faults.trial import Happened
from benchmarks.side_by_side import side_by_side
from twbal.core.episode import Episode, Event, Outcome, Provenance
from twbal.io.logs import write_episode
from twbal.link.decoder import to_wire
from twbal.link.protocol import Command, Hello, Status, Stop, Telemetry

ROOT = Path(__file__).resolve().parents[2]
MESSAGES = [
    Hello(1),
    Command(0, 0.0, -0.0),
    Command(65535, 1.5, 2.0),
    Stop(256),
    Telemetry(7, 3, 2**32 - 1, 1, 0.1, 0.2),
]


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: type(message).__name__)
def test_the_judge_reads_and_writes_frames_as_twbal_does(message):
    assert Cutter().feed(to_wire(message)) == [message.encode()]
    assert framed(message.encode()) == to_wire(message)


def test_the_judge_reads_the_example_of_the_protocol_page_and_no_damaged_one():
    run = bytes.fromhex("0304 0103 6D23")
    assert payload_of(run) == bytes.fromhex("040100")
    for bit in range(8 * len(run)):
        spoilt = bytearray(run)
        spoilt[bit // 8] ^= 1 << bit % 8
        assert payload_of(bytes(spoilt)) != bytes.fromhex("040100")


def test_telemetry_and_commands_are_read():
    told = Telemetry(7, 3, 123, Status.ARMED, 0.1, 0.2, command_us=99, dropped=5)
    assert said_in(told.encode()) == Said(7, 3, 123, 1, 99, 5)
    assert (total_in(Command(1, 1.5).encode()), total_in(Stop(1).encode())) == (1.5, None)


@pytest.mark.parametrize("share", [0.01, 0.1])
def test_bytes_meet_their_fate_as_often_as_they_are_to(share):
    data = bytes(range(256)) * 80
    lost = len(data) - len(dropped(share, Random(1))(data))
    more = len(doubled(share, Random(1))(data)) - len(data)
    other = sum(a != b for a, b in zip(corrupted(share, Random(1))(data), data, strict=True))
    moved = sum(a != b for a, b in zip(swapped(share, Random(1))(data), data, strict=True)) / 2
    for found in (lost, more, other, moved):
        assert found == pytest.approx(share * len(data), rel=0.2)


def test_frames_are_dropped_doubled_or_swapped_whole():
    sent = [bytes([6, k, 0]) for k in range(200)]
    stream = b"".join(map(framed, sent))

    def arrives(fate):
        return Cutter().feed(Frames(0.1, Random(2), fate)(stream))

    few, many, other = arrives("dropped"), arrives("doubled"), arrives("swapped")
    assert 10 <= len(sent) - len(few) == len(many) - len(sent) <= 30
    assert [payload for payload in sent if payload in few] == few
    assert len(other) in (len(sent), len(sent) - 1) and other != sent[: len(other)]


def test_the_other_clock_begins_with_the_rollout_and_frames_stay_whole():
    way = OtherClock(lambda begin, now: now - begin - 50)
    told = [said_in(Cutter().feed(way(to_wire(Telemetry(1, k, 10**6 + 20 * k, 1, 0, 0))))[0]) for k in range(5)]
    assert [said.time_us for said in told] == [2**32 - 50, 2**32 - 30, 2**32 - 10, 10, 30]


def test_the_first_stop_is_lost_and_the_second_comes():
    way = WithoutStop(1)
    sent = [Command(1, 0.0), Stop(2), Stop(2), Hello(3)]
    assert [Cutter().feed(way(to_wire(message))) != [] for message in sent] == [True, False, True, True]


PERIODS = 30


def happened(folder, name="none", code=0, until=PERIODS, late=0, **changes):
    """A trial that went right in `until` periods, and then got torque for `late` more without a command."""
    folder.mkdir(exist_ok=True)
    passed = Passed(rollouts=1)
    for k in range(until + late + 1):
        taken = 20_000 * min(k, until) - (19_000 if k else 0)
        passed.sent.append((0.02 * k, Said(k, k, 5000 + 20_000 * k, 1, 5000 + max(taken, 0), 0)))
    for k in range(1, until + 1):
        passed.commanded[k] = 0.5 * k
        passed.unasked[k] = 0.02 * k - 0.025
        passed.reached.append((0.02 * k - 0.019, k, 0.5 * k))
        passed.heard.append((0.02 * k, passed.sent[k][1]))
    torques = [0.5 * min(k + 1, until) for k in range(until + late)] + [0.0] * 5
    complaints = ["twbal: error: The robot paper stopped itself: it had no command (its watchdog)."] if code else []
    done = Happened(kinds("real_time")[name], passed, torques, code, complaints, folder)
    return replace(done, **changes)


def with_episode(done, events=(), steps=PERIODS):
    """The trial, with what was kept of it."""
    outcome, name = (Outcome.LINK_LOST, "interrupted") if done.code else (Outcome.COMPLETED, "episodes")
    seen = np.zeros((steps + 1, 7))
    seen[:, 0] = 0.02 * np.arange(steps + 1)
    channels = ("tilt", "tilt_rate")
    provenance = Provenance("paper", "robot")
    episode = Episode(channels, 0.02, seen, np.zeros((steps + 1, 2)), np.zeros(steps), outcome, provenance, events)
    write_episode(done.folder / name / "trial_000.mcap", episode)
    return done


def misses(done):
    return " | ".join(judged(done, True).misses)


def test_what_went_right_is_right(tmp_path):
    verdict = judged(with_episode(happened(tmp_path)), True)
    assert (verdict.misses, verdict.off_ms, verdict.samples) == ((), pytest.approx(19.0), PERIODS)
    assert misses(with_episode(happened(tmp_path / "ended", "silence to the robot, 1 s", code=1, late=4))) == ""


def test_the_time_to_torque_0_is_that_of_the_motors_and_the_robots_clock(tmp_path):
    assert off_ms(happened(tmp_path, late=4)) == pytest.approx(99.0)
    late = with_episode(happened(tmp_path, "silence to the robot, 1 s", code=1, late=5))
    assert misses(late) == "torque for 119 ms after the last command"
    wrapped = happened(tmp_path)
    near = 2**32 - 300_000
    wrapped.passed.sent[:] = [
        (t, s._replace(time_us=(s.time_us + near) % 2**32, command_us=(s.command_us + near) % 2**32))
        for t, s in wrapped.passed.sent
    ]
    assert off_ms(wrapped) == pytest.approx(19.0)


def test_a_computer_that_is_late_is_told_from_a_fault(tmp_path):
    passed = happened(tmp_path).passed
    passed.sent[:] = [(said.time_us * 1e-6 + 0.003, said) for _, said in passed.sent]
    passed.heard[:] = [(said.time_us * 1e-6 + 0.004, said) for _, said in passed.heard]
    passed.asked.update({said.seq + 1: now + 0.002 for now, said in passed.heard})
    assert lateness(passed, True) == pytest.approx(0.003, abs=1e-6)
    passed.asked[9] += 0.05
    assert lateness(passed, True) == pytest.approx(0.052, abs=1e-6)
    now, said = passed.sent[5]
    passed.sent[5] = (now + 0.08, said)
    assert lateness(passed, True) == pytest.approx(0.083, abs=1e-6)


def test_in_lockstep_a_late_robot_is_one_whose_answer_takes_long(tmp_path):
    passed = happened(tmp_path).passed
    passed.heard.clear()
    assert lateness(passed, False) == pytest.approx(0.019)
    passed.reached.append((0.5, 12, 6.0))  # sent again: the first one counts
    assert lateness(passed, False) == pytest.approx(0.019)
    passed.sent[12] = (passed.sent[12][0] + 0.3, passed.sent[12][1])
    assert lateness(passed, False) == pytest.approx(0.319)


def doubled_numbers(jobs):
    """Work whose results say which job they are of."""
    for job in jobs:
        yield job, os.getpid()


def test_workers_share_the_jobs_and_do_each_once():
    done = list(side_by_side(doubled_numbers, 200, 3))
    assert sorted(job for job, _ in done) == list(range(200))
    assert os.getpid() not in {process for _, process in done}


def failing(jobs):
    """Work that ends too early."""
    for job in jobs:
        if job == 2:
            os._exit(3)
        yield job


def test_a_worker_that_ends_before_its_work_is_an_error():
    with pytest.raises(SystemExit, match="ended before"):
        list(side_by_side(failing, 4, 1))


def test_torque_that_nobody_asked_for_is_found(tmp_path):
    done = with_episode(happened(tmp_path))
    assert misses(replace(done, torques=[*done.torques[:3], 7.25, *done.torques[4:]])) == (
        "1 torques that nobody asked for"
    )


def test_a_rollout_that_ends_without_need_is_a_miss(tmp_path):
    assert "ended, though it can be ridden out" in misses(with_episode(happened(tmp_path / "a", code=1)))
    done = with_episode(happened(tmp_path / "b", "bytes dropped, 1 %", code=1))
    assert misses(done) == ""  # no Stop was answered
    done.passed.heard.append((0.7, done.passed.sent[-1][1]._replace(status=0)))
    done.passed.stopping = 0.7
    assert "enough came through" in misses(done)
    done.passed.commanded[PERIODS + 1], done.passed.unasked[PERIODS + 1] = 0.5, 0.02 * PERIODS
    done.passed.stopping = 0.02 * PERIODS + 0.4
    assert "enough came through" in misses(done)  # it waited for less than 0.5 s
    done.passed.stopping += 0.1
    assert misses(done) == ""
    answer = done.passed.sent[-1][1]._replace(seq=PERIODS + 1)
    done.passed.heard.append((0.02 * PERIODS + 0.5, answer))
    assert misses(done) == ""  # the answer came when the host had given up
    done.passed.heard.append((0.02 * PERIODS + 0.3, answer))
    assert "enough came through" in misses(done)
    starved = with_episode(happened(tmp_path / "c", "bytes dropped, 1 %", code=1, late=4))
    assert misses(starved) == ""
    assert misses(with_episode(happened(tmp_path / "d", "IMU frozen"))) == "did not end"


def test_the_command_must_end_with_one_error_of_the_right_reason(tmp_path):
    done = with_episode(happened(tmp_path, "clock frozen", code=1))
    assert "says another reason" in misses(done)
    right = "twbal: error: The clock of the robot paper does not run forward."
    assert misses(replace(done, complaints=[right])) == ""
    assert "exit code 1 with 2 lines" in misses(replace(done, complaints=[right, "Traceback"]))


def test_an_episode_that_lacks_what_was_driven_is_a_miss(tmp_path):
    done = happened(tmp_path, "silence to the robot, 1 s", code=1, late=4)
    assert misses(done) == "no episode is kept"
    assert (
        misses(with_episode(done, steps=PERIODS - 2))
        == f"{PERIODS - 2} commands are kept of {PERIODS} that were answered"
    )


def test_spoilt_frames_that_no_event_tells_of_are_a_miss(tmp_path):
    done = happened(tmp_path, "bytes dropped, 0.1 %")
    done.passed.told.update([b"lost", b"came"])
    done.passed.whole.update([b"came", b"came"])
    assert "1 frames were spoilt" in misses(with_episode(done))
    assert misses(with_episode(done, (Event(0.1, "1 damaged frames came from the robot"),))) == ""


def test_a_host_that_was_killed_must_say_next_time_what_was_kept(tmp_path):
    done = with_episode(happened(tmp_path, "host killed"))
    killed = replace(done, code=137, complaints=[], again=0)
    assert (
        misses(replace(killed, said_again="an earlier start was cut short; trials kept: 1 whole, 0 interrupted")) == ""
    )
    assert misses(killed) == "the next start does not say what was kept"
    assert "the next start ends with 1" in misses(replace(killed, again=1))


def test_tables_count_what_went_on_and_what_ended():
    found = {"kind": "IMU frozen", "trials": 3, "ridden": 1, "off_ms": [18.0, 97.6], "misses": ["trial 2: did not end"]}
    results = {
        "virtual lockstep": [found],
        "firmware real_time": [{**found, "kind": "none", "ridden": 3, "misses": []}],
    }
    assert link_faults(results)[2:] == [
        "| IMU frozen | goes on 1, ends 2: 98 ms | not run |",
        "| none | not run | goes on 3 |",
    ]
    lines = link_fault_misses(results)
    assert lines[0] == "1 of 6 trials were not right:"
    assert lines[-1] == "| virtual robot, lockstep | IMU frozen | trial 2: did not end |"


@pytest.mark.parametrize("words", [["robot=real"], ["kinds=fire"], ["times=few"], ["seed=1"]])
def test_settings_that_are_none_are_refused(words):
    with pytest.raises(SystemExit, match=r"Settings are robot \(virtual, firmware\)"):
        settings_of(words)


def campaign(folder, *words):
    """What trials by the real command and a robot's process came to."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "benchmarks.link_faults", *words]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=280)
    assert done.returncode == 0, done.stderr
    (found,) = json.loads((folder / "benchmarks" / "results" / "link_faults.json").read_text()).values()
    return {each["kind"]: each for each in found}


@pytest.mark.slow
def test_some_faults_in_lockstep(tmp_path):
    rides = ("bytes corrupted, 0.1 %", "silence to the host, 50 ms", "clock wraps")
    ends = ("port vanishes and comes back", "host killed", "IMU frozen", "tilt becomes NaN")
    found = campaign(tmp_path, "times=1", f"kinds={';'.join((*rides, *ends))}")
    assert {kind: each["misses"] for kind, each in found.items()} == {kind: [] for kind in (*rides, *ends)}
    assert {kind: each["ridden"] for kind, each in found.items()} == {
        **dict.fromkeys(rides, 1),
        **dict.fromkeys(ends, 0),
    }
