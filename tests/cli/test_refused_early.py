"""What cannot work is refused in one line before anything is done, and what is given twice is told."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from twbal.cli.main import main
from twbal.cli.manifest import read_manifest
from twbal.cli.stages import regress

DATA = Path(__file__).parents[2] / "data" / "regression"


@pytest.mark.parametrize("words", [["initial_policy=lqr"], ["initial_policy=agent"], ["method=lqr", "updates=1"]])
def test_updates_of_a_policy_that_is_not_searched_are_refused_before_the_robot_is_driven(words, tmp_path, capsys):
    assert main(["iterate", *words, f"hydra.run.dir={tmp_path}"]) == 1
    said = capsys.readouterr()
    assert "is none that a search can begin with" in said.err and "->" not in said.out


@pytest.mark.parametrize("channels", ["[tilt]", "[speed,tilt]", "[tilt,tilt]"])
def test_a_cost_of_other_channels_than_the_state_is_refused(channels, tmp_path, capsys):
    assert main(["lqr", f"cost.channels={channels}", f"hydra.run.dir={tmp_path}"]) == 1
    said = capsys.readouterr().err
    assert "cost" in said and "Traceback" not in said


@pytest.mark.parametrize("policy", ["random", "excite"])
def test_only_saved_policies_are_exported(policy, tmp_path, capsys):
    assert main(["export-policy", f"policy={policy}", f"hydra.run.dir={tmp_path}"]) == 1
    assert "expected is a policy of a file: policy=saved" in capsys.readouterr().err


def test_one_log_to_compare_with_is_a_path_and_not_its_letters(tmp_path, capsys):
    logs = sorted((DATA / "real").rglob("*.mcap"))[:2]
    words = [f"episode={logs[0]}", f"compare_with={logs[1]}", "film=false", f"hydra.run.dir={tmp_path}"]
    assert main(["plot", *words]) == 0, capsys.readouterr().err


def test_a_recording_that_is_given_twice_is_told_by_the_fits_too(tmp_path, capsys):
    logs = sorted((DATA / "real").rglob("*.mcap"))[:1] * 2
    words = [f"episodes=[{','.join(map(str, logs))}]", "dynamics=null", f"hydra.run.dir={tmp_path}"]
    main(["fit-diff-gp", *words])
    assert "it counts twice" in capsys.readouterr().out


def test_ctrl_c_ends_simulations_by_several_processes_at_once_and_without_their_words(tmp_path):
    words = ["sim-collect", "rollouts=3000", "steps=200", "workers=2", f"hydra.run.dir={tmp_path}"]
    command = [sys.executable, "-P", "-m", "twbal", *words]
    process = subprocess.Popen(
        command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    assert process.stdout is not None
    time.sleep(4.0)  # its workers are being started, or are at work
    os.killpg(process.pid, signal.SIGINT)
    said, errors = process.communicate(timeout=60)
    assert process.returncode == 130, said + errors
    assert "Traceback" not in errors and "SpawnProcess" not in errors


@pytest.mark.parametrize(
    "word",
    [
        "+effect@sim.effect.dead_zone=dead_zone",
        "+sim.effect.dead_zone.width=3",
        "+sim.efects={dead_zone:3}",
        "+effect@sim.efects.dead_zone=dead_zone",
    ],
)
def test_effects_in_a_part_that_nothing_reads_are_refused(word, tmp_path, capsys):
    assert main(["sim-collect", "rollouts=1", word, f"hydra.run.dir={tmp_path}"]) == 1
    said = capsys.readouterr().err
    assert "has no setting 'sim.ef" in said and "did you mean 'sim.effects'?" in said


@pytest.mark.parametrize("stage", ["lqr", "fit-sim-gp", "real-rollout"])
def test_effects_for_a_stage_without_a_simulation_are_refused(stage, tmp_path, capsys):
    words = {"fit-sim-gp": [f"episodes={DATA / 'real'}"], "real-rollout": [f"policy.path={DATA / 'policy.pt'}"]}
    given = ["+effect@sim.effects.x=dead_zone", *words.get(stage, []), f"hydra.run.dir={tmp_path}"]
    assert main([stage, *given]) == 1
    assert "has no setting 'sim'" in capsys.readouterr().err


def test_compare_writes_over_nothing_of_a_person_or_of_another_stage(tmp_path, capsys):
    own, other = tmp_path / "own", tmp_path / "lqr"
    own.mkdir()
    (own / "table.csv").write_text("my data")
    assert main(["lqr", f"hydra.run.dir={other}"]) == 0
    runs = f"runs=[{DATA / 'policy.pt'}]"
    fast = ["robustness=true", "perturbation.trials=1"]
    for folder in (own, other):
        assert main(["compare", runs, *fast, f"hydra.run.dir={folder}"]) == 1
    assert (own / "table.csv").read_text() == "my data"
    said = capsys.readouterr().err
    assert "files that could be written over: table.csv" in said and "holds the work of stage lqr" in said


def test_regress_writes_over_nothing_of_a_person_and_says_that_it_is_done(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(regress, "measure", lambda cfg, folder: {"a": 1.0})
    own, out = tmp_path / "own", tmp_path / "out"
    own.mkdir()
    (own / "measures.json").write_text("my data")
    (tmp_path / "tolerances.yaml").write_text("'*': {relative: 0.1, absolute: 0.1}\n")
    words = [f"data={DATA}", f"baseline={tmp_path / 'baseline.json'}", f"tolerances={tmp_path / 'tolerances.yaml'}"]
    assert main(["regress", *words, "update=true", f"hydra.run.dir={own}"]) == 1
    assert "files that could be written over: measures.json" in capsys.readouterr().err
    assert (own / "measures.json").read_text() == "my data" and not (tmp_path / "baseline.json").exists()
    for more in (["update=true"], [], []):  # again in its own folder
        assert main(["regress", *words, *more, f"hydra.run.dir={out}"]) == 0
        made = read_manifest(out)
        assert made is not None and made.complete


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (['link.overrides=["faults=lihgt"]'], "lihgt"),
        (['link.overrides=["self_stop=1"]'], "self_stop"),
        (['link.overrides=["watchdog=-1"]'], "watchdog=-1"),
        (["link.robot=nobody"], "nobody"),
        (
            ["robot.control_period=0.0166667"],
            'overrides=["idle_timeout=300","robot.control_period=0.0166667"]',
        ),
    ],
)
def test_iterate_refuses_settings_of_its_virtual_robot_before_its_first_stage(words, expected, tmp_path, capsys):
    assert main(["iterate", *words, f"hydra.run.dir={tmp_path}"]) == 1
    said = capsys.readouterr()
    assert expected in said.err and len(said.err.splitlines()) == 1
    assert "->" not in said.out and read_manifest(tmp_path) is None
