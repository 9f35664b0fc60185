"""What a next command repeats of the words that this run was given."""

import shlex

import pytest

from twbal.cli.composed import composed
from twbal.cli.composition import composing
from twbal.cli.console import last_of_each
from twbal.cli.main import main
from twbal.cli.tested_robots import robot_of_link


def test_of_overrides_of_the_same_key_the_last_one_counts():
    words = ["robot=regbot", "robot.control_period=0.02", "seed=1", "robot.control_period=0.01"]
    assert last_of_each(words) == ["robot=regbot", "seed=1", "robot.control_period=0.01"]


@pytest.mark.parametrize("given", [["robot.control_period=0.0166667"], ["robot.control_period=0.02"] * 2])
def test_the_command_after_lqr_repeats_no_key_and_drives_at_the_period(given, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("sys.argv", ["twbal"])
    assert main(["lqr", *given, f"hydra.run.dir={tmp_path}"]) == 0
    (line,) = (line for line in capsys.readouterr().out.splitlines() if line.startswith("next  "))
    _, stage, *words = shlex.split(line.removeprefix("next  "))
    keys = [word.partition("=")[0] for word in words]
    assert stage == "real-rollout" and len(set(keys)) == len(keys)
    cfg = composed(stage, words)
    with composing():
        period = robot_of_link(cfg).robot.sheet.control_period
    assert period == cfg.robot.control_period == float(given[0].partition("=")[2])
