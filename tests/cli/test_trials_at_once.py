"""Trials of virtual robots in lockstep that are driven beside each other."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from omegaconf import OmegaConf

from twbal.algorithm.settings import RolloutSettings
from twbal.cli.main import main
from twbal.cli.trials_at_once import beside_each_other, never, robots_at_once
from twbal.core.errors import LinkLostError

PATIENCE = 60.0  # s


def settings(trials):
    return RolloutSettings(seed=0, trials=trials, first_trial=7, steps=10, tilt_limit=0.5, exploration=0.0)


def link(**told):
    return OmegaConf.create({"overrides": [], "clock": "lockstep", **told})


@pytest.mark.parametrize(
    ("trials", "robot", "cores", "expected"),
    [
        (10, link(), 2, 2),
        (10, link(), 64, 5),
        (3, link(), 2, 1),
        (10, link(), None, 1),
        (10, link(clock="real_time"), 2, 1),
        (10, link(program="firmware/build/robot_posix"), 2, 1),
        (10, OmegaConf.create({"port": "/dev/ttyUSB0"}), 2, 1),
    ],
)
def test_only_virtual_robots_in_lockstep_are_several(trials, robot, cores, expected, monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: cores)
    assert robots_at_once(robot, settings(trials)) == expected


@pytest.mark.parametrize("robots", [1, 2, 3])
def test_every_trial_is_driven_once_and_logs_are_in_order(robots):
    assert beside_each_other(lambda part, _: list(part.numbers), settings(7), robots) == list(range(7, 14))


def test_one_trial_that_fails_ends_those_beside_it_and_its_error_is_raised():
    ended = []

    def drive(part, is_stopping):
        if part.first_trial != 7:
            raise LinkLostError("the robot fell silent")
        deadline = time.monotonic() + PATIENCE
        while not is_stopping() and time.monotonic() < deadline:
            time.sleep(0.01)
        ended.append(is_stopping())
        raise KeyboardInterrupt  # as of a trial that was stopped

    with pytest.raises(LinkLostError, match="fell silent"):
        beside_each_other(drive, settings(4), 2)
    assert ended == [True]


def test_none_is_to_end_where_there_is_one_robot():
    assert beside_each_other(lambda part, is_stopping: [is_stopping is never], settings(4), 1) == [True]


@pytest.mark.usefixtures("kept_robots")
def test_the_same_episodes_are_logged_on_any_number_of_cores(tmp_path, monkeypatch):
    """But for the time at which each was recorded, which logs do not have."""
    logs = []
    for cores in (1, 2):
        monkeypatch.setattr("os.cpu_count", lambda cores=cores: cores)
        out = tmp_path / str(cores)
        assert main(["real-rollout", "policy=random", "trials=4", "steps=30", f"hydra.run.dir={out}"]) == 0
        logs.append({file.name: file.read_bytes() for file in (out / "episodes").iterdir()})
    assert len(logs[0]) == 4
    assert logs[0] == logs[1]


def test_ctrl_c_ends_all_trials_keeps_what_there_is_and_leaves_no_robot(tmp_path):
    words = ["experiment=excite", "trials=4", "steps=1000000", f"hydra.run.dir={tmp_path / 'out'}"]
    program = "import os, signal, sys; os.cpu_count = lambda: 2; from twbal.cli.main import main; sys.exit(main())"
    command = [sys.executable, "-c", program, "real-rollout", *words, 'link.overrides=["faults=none"]', "seed=0"]
    process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        robots = _robots_of(process.pid)
        time.sleep(5.0)  # they shake hands
        process.send_signal(signal.SIGINT)
        said, _ = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
    assert process.returncode == 130, said
    assert said.count("The robot confirmed that its motors are off.") == 2
    kept = sorted(file.name for file in (tmp_path / "out" / "interrupted").iterdir())
    assert kept == ["trial_000_stopped_0.mcap", "trial_002_stopped_0.mcap"]
    assert not [pid for pid in robots if _is_running(pid)]


def _robots_of(pid):
    """The two virtual robots of a process, once they are there."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        threads = Path(f"/proc/{pid}/task").glob("*/children")  # each has its own
        found = [child for children in threads for child in children.read_text().split()]
        if len(found) == 2:
            return found
        time.sleep(0.1)
    raise AssertionError("no two robots")


def _is_running(pid):
    return os.path.exists(f"/proc/{pid}/exe")
