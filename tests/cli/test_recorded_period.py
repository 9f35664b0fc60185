"""Logs of another control period than the data sheet's: the stages that read nothing else go by that of the logs."""

import json
import shlex
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from twbal.cli.composed import composed
from twbal.cli.composition import composing
from twbal.cli.known_robot import known_robot
from twbal.cli.main import main
from twbal.cli.tested_robots import robot_of_link
from twbal.core.episode import Provenance
from twbal.io.logs import read_episode, write_episode

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "diagnosis"))
from evaluated_logs import TRUE, log

PERIOD = 1.0 / 70.0  # s, which no physics step of whole milliseconds divides
TAKEN = "The recordings have a control period of 0.0142857 s; the data sheet's is 0.02 s. The former is used."
QUICK = {
    "diagnose": ["starts=2", "diagnosis.max_effects=1", "next_experiment=false", "free_form=false"],
    "evaluate-sim": ["horizons=[0.1]"],
    "identify": [],
}


@pytest.fixture(autouse=True)
def arguments(monkeypatch):
    """Hydra reads them."""
    monkeypatch.setattr("sys.argv", ["twbal"])


@pytest.fixture(scope="module")
def logs(paper, tmp_path_factory):
    """Two logs at 70 Hz of a robot whose sheet says 50 Hz, and a simulation that predicts them well."""
    folder = tmp_path_factory.mktemp("logs")
    for seed in (1, 2):
        faster = replace(paper, control_period=PERIOD)
        write_episode(folder / f"{seed}.mcap", log(faster, TRUE, seed, periods=700).episode)
    (folder / "better.yaml").write_text(
        "effects:\n  coulomb_friction: {torque: 0.3}\n  actuation_delay: {delay: 0.02}\n"
    )
    return folder


def settings_in(folder):
    return yaml.safe_load(json.loads((folder / "manifest.json").read_text())["settings"])


def words_of(said):
    """The words of the next command that was printed, and its stage."""
    (line,) = (line for line in said.splitlines() if line.startswith("next  "))
    program, stage, *words = shlex.split(line.removeprefix("next  "))
    assert program == "twbal"
    return stage, words


def test_an_evaluation_takes_it_and_its_next_command_works(logs, tmp_path, capsys):
    words = [f"episodes={logs}", f"sims=[{logs / 'better.yaml'}]", *QUICK["evaluate-sim"]]
    assert main(["evaluate-sim", *words, f"hydra.run.dir={tmp_path / 'out'}"]) == 0
    said = capsys.readouterr().out
    assert said.count(TAKEN) == 1
    assert settings_in(tmp_path / "out")["robot"]["control_period"] == PERIOD
    stage, following = words_of(said)
    assert stage == "sim-collect" and f"robot.control_period={PERIOD!r}" in following
    small = ["rollouts=1", "steps=5", f"hydra.run.dir={tmp_path / 'sim'}"]
    assert main([stage, *following, *small]) == 0
    assert read_episode(tmp_path / "sim" / "episodes" / "trial_000.mcap").control_period == PERIOD


def test_the_same_work_is_not_done_again_whoever_says_the_period(logs, tmp_path, capsys):
    words = [f"episodes={logs}", *QUICK["evaluate-sim"], f"hydra.run.dir={tmp_path}"]
    assert main(["evaluate-sim", *words]) == 0
    before = (tmp_path / "manifest.json").read_bytes()
    assert main(["evaluate-sim", *words, f"robot.control_period={PERIOD!r}"]) == 0
    assert TAKEN not in capsys.readouterr().out.partition("next  ")[2]
    assert (tmp_path / "manifest.json").read_bytes() == before


def test_an_identification_takes_it_with_a_step_that_divides_it_and_its_next_command_works(logs, tmp_path, capsys):
    assert main(["identify", f"episodes={logs}", f"hydra.run.dir={tmp_path}"]) == 0
    said = capsys.readouterr().out
    assert TAKEN in said
    step = yaml.safe_load((tmp_path / "identified.yaml").read_text())["physics_step"]
    assert step <= 0.001 and PERIOD / step == pytest.approx(round(PERIOD / step), rel=1e-9)
    made_by = settings_in(tmp_path)
    assert made_by["robot"]["control_period"] == PERIOD and made_by["sim"]["physics_step"] == step == PERIOD / 15
    stage, following = words_of(said)
    cfg = composed(stage, following)
    assert stage == "iterate" and cfg.robot.control_period == PERIOD
    with composing():
        assert known_robot(cfg).robot.control_period == PERIOD
        assert robot_of_link(cfg).robot.sheet.control_period == PERIOD
    assert "link=serial link.port=... in the place of link.overrides=[...]" in said


def test_a_diagnosis_takes_it_and_its_next_command_works(logs, tmp_path, capsys):
    words = [f"episodes={logs / '1.mcap'}", f"test_episodes={logs / '2.mcap'}", f"sim={logs / 'better.yaml'}"]
    assert main(["diagnose", *words, *QUICK["diagnose"], f"hydra.run.dir={tmp_path}"]) == 0
    said = capsys.readouterr().out
    assert TAKEN in said
    assert settings_in(tmp_path)["robot"]["control_period"] == PERIOD
    step = yaml.safe_load((tmp_path / "augmented.yaml").read_text())["physics_step"]
    assert PERIOD / step == pytest.approx(round(PERIOD / step), rel=1e-9)
    stage, following = words_of(said)
    cfg = composed(stage, following)
    assert cfg.robot.control_period == PERIOD
    if "link" in cfg:
        with composing():
            assert robot_of_link(cfg).robot.sheet.control_period == PERIOD


@pytest.mark.parametrize("stage", QUICK)
def test_a_period_that_the_command_line_says_counts(stage, logs, tmp_path, capsys):
    words = [f"episodes={logs}", "robot.control_period=0.01", *QUICK[stage], f"hydra.run.dir={tmp_path}"]
    assert main([stage, *words]) == 1
    said = capsys.readouterr()
    assert "The former is used" not in said.out
    assert f"set its period by robot.control_period={PERIOD!r}" in said.err and len(said.err.splitlines()) == 1


@pytest.mark.parametrize("stage", QUICK)
def test_different_periods_are_one_clear_error(stage, logs, paper, tmp_path, capsys):
    write_episode(tmp_path / "even.mcap", log(paper, TRUE, 3, periods=500).episode)
    words = [f"episodes=[{logs},{tmp_path / 'even.mcap'}]", *QUICK[stage], f"hydra.run.dir={tmp_path / 'out'}"]
    assert main([stage, *words]) == 1
    said = capsys.readouterr().err
    assert f"different control periods: 0.0142857 s ({logs / '1.mcap'}) and 0.02 s ({tmp_path / 'even.mcap'})" in said
    assert "give the recordings of one period at a time" in said and len(said.splitlines()) == 1


def test_test_episodes_of_another_period_are_told_before_the_diagnosis(logs, paper, tmp_path, capsys):
    write_episode(tmp_path / "even.mcap", log(paper, TRUE, 3, periods=500).episode)
    words = [f"episodes={tmp_path / 'even.mcap'}", f"test_episodes={logs}", f"hydra.run.dir={tmp_path / 'out'}"]
    assert main(["diagnose", *words]) == 1
    assert "different control periods" in capsys.readouterr().err


def test_logs_of_another_robot_do_not_change_the_period(logs, tmp_path, capsys):
    other = replace(read_episode(logs / "1.mcap"), provenance=Provenance("regbot", "robot"))
    write_episode(tmp_path / "other.mcap", other)
    assert main(["identify", f"episodes={tmp_path / 'other.mcap'}", f"hydra.run.dir={tmp_path / 'out'}"]) == 1
    said = capsys.readouterr()
    assert "is an episode of the robot 'regbot'; expected is 'paper'" in said.err
    assert "The former is used" not in said.out


def test_a_period_that_no_robot_has_is_refused(paper, tmp_path, capsys):
    slow = replace(log(paper, TRUE, 1, periods=100).episode, control_period=3.0)
    write_episode(tmp_path / "slow.mcap", slow)
    assert main(["identify", f"episodes={tmp_path / 'slow.mcap'}", f"hydra.run.dir={tmp_path / 'out'}"]) == 1
    assert "robot.control_period" in capsys.readouterr().err
