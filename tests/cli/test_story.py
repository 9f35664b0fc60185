"""Whatever happened in a run, its report and its printed summary say that, and nothing that did not happen.

Five kinds of run: solved at once, solved after updates, never solved, interrupted, diagnosed. (What an update by f + g
says is read in test_iterate.py, of the run that is there already.)
"""

import math
import os
import shlex
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from small_run import OVERRIDES
from story import check, holds, untimed

import twbal
from twbal.algorithm.summary import read_summary
from twbal.cli.chain import Chain
from twbal.cli.main import main
from twbal.cli.manifest import read_manifest

ROOT = Path(__file__).resolve().parents[2]
SMALLEST = [*OVERRIDES, "ensemble=none", "sim_rounds=0", "calibration_rollouts=1", "calibration_steps=20"]
UPRIGHT = ["success.place_radii=null", "success.command_change=null"]  # nothing else is asked
ALWAYS = [
    *("success.duration=0.2", "success.settle_time=0.2", *UPRIGHT),
    *("success.tilt_limit=1.5", "success.settled_tilt_limit=1.5", "stop_when_solved=true", "improve=false"),
]
NEVER = ["success.settled_tilt_limit=1e-3", "success.settle_time=0.02"]
LINEAR = ["method=lqr_identified", "link.seed=783", "trials=2", "success.duration=3", "improve=false", *UPRIGHT]


def next_commands(printed: str) -> list[list[str]]:
    return [shlex.split(line)[1:] for line in printed.splitlines() if line.startswith("next ")]


def iterate(folder: Path, *words: str) -> None:
    arguments = sys.argv
    try:
        assert main(["iterate", *words, f"hydra.run.dir={folder}"]) == 0
    finally:
        sys.argv = arguments


@pytest.mark.slow
def test_solved_at_once(tmp_path, capsys):
    iterate(tmp_path, *SMALLEST, *ALWAYS)
    printed = capsys.readouterr().out
    first, second = check(tmp_path, printed)
    assert (first.policy, first.searched, second.searched) == (second.policy, True, False)  # what this kind is
    assert second.rollout_seconds > 0
    assert [line.split()[1] for line in printed.splitlines() if line.lstrip().startswith("* ")] == [
        "0",
        "0",
    ]  # both tables
    assert [command[1] for command in next_commands(printed)] == ["real-rollout"]


@pytest.mark.slow
def test_never_solved_and_gone_on_with(tmp_path, capsys):
    folder = tmp_path / "a run"
    iterate(folder, *LINEAR, *NEVER, "updates=1")
    printed = capsys.readouterr().out
    disk = check(folder, printed)
    assert not any(iteration.successes for iteration in disk)
    assert [command[1] for command in next_commands(printed)] == ["iterate", "diagnose"]
    more, diagnose = next_commands(printed)
    assert "updates=4" in more  # three more than there were
    assert f"{folder}/iteration_0/rollout" in diagnose[2]
    began = read_manifest(folder / "iteration_0" / "trials")
    assert main(["iterate", *("updates=2" if word == "updates=4" else word for word in more[2:])]) == 0
    longer = check(folder, capsys.readouterr().out)
    assert longer[:2] == disk
    assert len(longer) == 3
    assert read_manifest(folder / "iteration_0" / "trials") == began


@pytest.mark.slow
def test_interrupted_and_solved_after_updates(tmp_path, capsys, monkeypatch):
    stages = []

    def run(chain, call, whole=Chain.run):
        stages.append(call.stage)
        if len(stages) == 4:
            raise KeyboardInterrupt
        return whole(chain, call)

    monkeypatch.setattr(Chain, "run", run)
    assert main(["iterate", *LINEAR, f"hydra.run.dir={tmp_path}"]) != 0
    assert not (tmp_path / "summary.json").exists()
    capsys.readouterr()
    iterate(tmp_path, *LINEAR)
    printed = capsys.readouterr().out
    assert printed.count("is there already") == 3
    disk = check(tmp_path, printed)
    assert [iteration.successes for iteration in disk] == [0, 0, 2]  # what this kind is
    assert [command[1] for command in next_commands(printed)] == ["real-rollout"]


@pytest.mark.slow
def test_a_killed_run_tells_the_same_as_an_undisturbed_one(tmp_path, capsys):
    killed = subprocess.Popen(
        [sys.executable, "-m", "twbal", "iterate", *LINEAR, f"hydra.run.dir={tmp_path / 'killed'}"],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        text=True,
    )
    seen = 0
    for line in killed.stdout:
        seen += " -> " in line
        if seen == 4:
            break
    killed.kill()
    killed.communicate()
    told = []
    for name in ("killed", "undisturbed"):
        iterate(tmp_path / name, *LINEAR)
        printed = capsys.readouterr().out
        told.append((check(tmp_path / name, printed), [line for line in printed.splitlines() if "robot is" in line]))
    assert told[0] == told[1]
    assert len(told[0][1]) == 1


DIAGNOSED = [
    *(*SMALLEST, *NEVER, "trials=2", "updates=1", "search_retries=1", "diagnose=true"),
    *("real_rollout.trials=4", "real_rollout.steps=60", "diagnosis=default", "diagnosis.shortlist=1"),
    *("diagnosis.max_effects=1", "diagnosis.substeps=4"),
]


@pytest.mark.slow
def test_diagnosed(tmp_path, capsys):
    iterate(tmp_path, *DIAGNOSED)
    disk = check(tmp_path, capsys.readouterr().out)
    assert [iteration.diagnosed for iteration in disk] == [False, True]


@pytest.mark.slow
def test_a_diagnosis_whose_simulation_is_used_comes_to_the_same_in_memory(tmp_path, monkeypatch):
    monkeypatch.setattr("twbal.algorithm.update.CLOSED", -math.inf)  # whatever it closes
    iterate(tmp_path, *DIAGNOSED)
    assert (tmp_path / "iteration_1" / "again_1" / "sim_model").is_dir()
    with twbal.connect() as plant:
        result = twbal.learn(plant, overrides=DIAGNOSED)
    summary = read_summary(tmp_path / "summary.json")
    again = summary.iterations[1].policy.path
    assert again == "iteration_1/again_1/policy/policy.pt"
    assert untimed(result.summary) == untimed(summary)


def test_the_rule_written_once_more_knows_each_part_of_it():
    rule = {"tilt_limit": 0.5, "settled_tilt_limit": 0.2, "place_radii": 1.0, "command_change": 0.1}
    rule |= {"duration": 0.08, "settle_time": 0.04, "place_time": 0.06, "control_period": 0.02}
    rule |= {"wheel_radius": 0.15, "torque_limit": 20.0}

    class Trial(NamedTuple):
        observations: np.ndarray
        poses: np.ndarray
        commands: np.ndarray

    def trial(*tilts: float, x: Sequence[float] = (0.0, 9.0, 9.0, 0.1, 0.1), last: float = 1.9) -> Trial:
        count = len(tilts)
        poses = np.column_stack([x[:count], np.zeros((count, 3))])
        commands = np.array([20.0, -20.0, 0.0, last])[: count - 1]
        return Trial(np.column_stack([0.02 * np.arange(count), tilts]), poses, commands)

    up = (0.4, 0.3, 0.1, 0.1, -0.1)
    assert holds(trial(*up), rule)
    assert not holds(trial(0.4, 0.6, 0.1, 0.1, 0.1), rule)
    assert not holds(trial(0.4, 0.3, 0.3, 0.1, 0.1), rule)
    assert not holds(trial(0.4, 0.3, 0.1, 0.1), rule)
    assert not holds(trial(*up, x=(0.0, 0.0, 0.0, 0.1, 0.16)), rule)
    assert not holds(trial(*up, last=2.1), rule)
    lenient = {**rule, "place_radii": None, "command_change": None}
    assert holds(trial(*up, x=(9.0,) * 5, last=20.0), lenient)
