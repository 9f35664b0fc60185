"""Trials of virtual robots in lockstep that are driven beside each other."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest
from omegaconf import OmegaConf

from twbal.algorithm.settings import RolloutSettings
from twbal.cli.main import main
from twbal.cli.trials_at_once import beside_each_other, robots_at_once
from twbal.core.errors import LinkLostError
from twbal.io.logs import read_episode

PATIENCE = 60.0  # s


def link(*overrides, **told):
    return OmegaConf.create({"overrides": list(overrides), "clock": "lockstep", **told})


@pytest.mark.parametrize(
    ("robot", "trials", "workers", "expected"),
    [
        (link(), 10, 2, 2),
        (link(), 10, 64, 5),
        (link(), 3, 2, 1),
        (link("idle_timeout=300"), 10, 2, 2),
        (link(), 10, 1, 1),
        (link(clock="real_time"), 10, 2, 1),
        (link("clock=real_time"), 10, 2, 1),
        (link("firmware=firmware/build/robot_posix"), 10, 2, 1),
        (link(program="firmware/build/robot_posix"), 10, 2, 1),
        (OmegaConf.create({"port": "/dev/ttyUSB0"}), 10, 2, 1),
    ],
)
def test_only_virtual_robots_in_lockstep_are_several(robot, trials, workers, expected):
    assert robots_at_once(robot, trials, workers) == expected


def test_a_robot_a_core_is_the_default(monkeypatch):
    monkeypatch.setattr("os.sched_getaffinity", lambda pid: {0, 1, 5}, raising=False)
    assert robots_at_once(link(), 10, 0) == 3


@pytest.mark.parametrize(("count", "sizes"), [(1, [7]), (2, [4, 3]), (3, [3, 2, 2])])
def test_parts_have_every_trial_once_and_in_order(count, sizes):
    settings = RolloutSettings(seed=0, trials=7, first_trial=5, steps=10, tilt_limit=0.5, exploration=0.0)
    parts = settings.parts(count)
    assert [part.trials for part in parts] == sizes
    assert [number for part in parts for number in part.numbers] == list(range(5, 12))


def test_logs_are_in_the_order_of_the_drives():
    def slow(why_stop):
        time.sleep(0.1)
        return ["first", "second"]

    assert beside_each_other([slow, lambda why_stop: ["third"]]) == ["first", "second", "third"]


def until_stopped(reasons):
    """Drives until it is to stop, and ends as a trial that was stopped."""

    def drive(why_stop):
        deadline = time.monotonic() + PATIENCE
        while why_stop() is None and time.monotonic() < deadline:
            time.sleep(0.01)
        reasons.append(why_stop())
        raise KeyboardInterrupt

    return drive


def failing(error):
    def drive(why_stop):
        raise error

    return drive


def test_one_trial_that_fails_ends_those_beside_it_and_its_error_is_raised():
    reasons = []
    with pytest.raises(LinkLostError, match="fell silent"):
        beside_each_other([until_stopped(reasons), failing(LinkLostError("the robot fell silent"))])
    assert reasons == ["stopped, as a trial beside it failed"]


def test_of_two_that_fail_the_error_of_one_is_raised_and_that_of_the_other_said(capsys):
    with pytest.raises(LinkLostError, match="silent"):
        beside_each_other([failing(LinkLostError("fell silent")), failing(LinkLostError("motors may still be on"))])
    assert "motors may still be on" in capsys.readouterr().out


def test_ctrl_c_ends_all_and_an_error_on_the_way_is_not_lost():
    reasons = []

    def pressed(why_stop):
        time.sleep(0.2)  # until the main thread waits for both
        os.kill(os.getpid(), signal.SIGINT)
        return until_stopped(reasons)(why_stop)

    with pytest.raises(KeyboardInterrupt):
        beside_each_other([pressed, until_stopped(reasons)])
    assert reasons == 2 * ["stopped by the person"]

    def ends_badly(why_stop):
        with suppress(KeyboardInterrupt):
            pressed(why_stop)
        raise LinkLostError("motors may still be on")

    with pytest.raises(LinkLostError, match="motors may still be on"):
        beside_each_other([until_stopped(reasons), ends_badly])


@pytest.mark.usefixtures("kept_robots")
def test_the_same_episodes_are_logged_by_any_number_of_robots(tmp_path):
    """Also where some were there before."""
    logs = []
    for workers in (1, 2):
        out = tmp_path / str(workers)
        words = ["real-rollout", "policy=random", "trials=5", "steps=30", f"hydra.run.dir={out}"]
        assert main([*words, f"workers={workers}"]) == 0
        logs.append({file.name: file.read_bytes() for file in (out / "episodes").iterdir()})
    assert len(logs[0]) == 5
    assert logs[0] == logs[1]
    killed = json.loads((out / "manifest.json").read_text()) | {"complete": False, "outputs": []}
    (out / "manifest.json").write_text(json.dumps(killed))
    for number in (0, 1, 3, 4):
        (out / "episodes" / f"trial_{number:03d}.mcap").unlink()
    assert main([*words, "workers=2"]) == 0
    assert {file.name: file.read_bytes() for file in (out / "episodes").iterdir()} == logs[0]


def test_ctrl_c_ends_all_trials_keeps_what_there_is_and_leaves_no_robot(tmp_path):
    out = tmp_path / "out"
    words = ["experiment=excite", "trials=60", "steps=500", "workers=2", f"hydra.run.dir={out}"]
    command = [sys.executable, "-m", "twbal", "real-rollout", *words, 'link.overrides=["faults=none"]']
    process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        deadline = time.monotonic() + PATIENCE
        first = [out / "episodes" / f"trial_{number:03d}.mcap" for number in (0, 30)]
        while not all(file.exists() for file in first) and time.monotonic() < deadline:
            time.sleep(0.05)
        robots = virtual_robots_of(process.pid)
        process.send_signal(signal.SIGINT)
        said, _ = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
    assert process.returncode == 130, said
    assert len(robots) == 2
    assert not [pid for pid in robots if os.path.exists(f"/proc/{pid}/exe")]
    kept = [read_episode(file) for file in out.rglob("*.mcap")]
    assert 2 <= len(kept) < 60
    stopped = [episode.events[-1].text for episode in kept if episode.outcome == "stopped"]
    assert set(stopped) <= {"stopped by the person"}
    assert said.count("The robot confirmed that its motors are off.") == len(stopped)


def virtual_robots_of(pid):
    """The processes of virtual robots that belong to a process."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):
            if f"\0parent={pid}\0".encode() in path.read_bytes():
                found.append(path.parent.name)
    return found
