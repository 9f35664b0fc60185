"""`twbal compare robustness=true`: what it reads, drives, writes and refuses."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from twbal.algorithm.robustness import Robustness
from twbal.cli.main import main
from twbal.core.json_records import read_record
from twbal.io.checkpoint import save_checkpoint
from twbal.policies.linear import LinearPolicy

sys.path.insert(0, str(Path(__file__).resolve().parent))
from test_compare import summary

NAMES = ("tilt", "tilt_rate", "speed", "position")
QUICK = [
    "robustness=true",
    "perturbation.trials=1",
    "perturbation.model_error=[0.2]",
    "perturbation.sensor_noise=[1.0]",
    "perturbation.torque_noise=[0.05]",
    "perturbation.motor_lag=[0.01]",
    "perturbation.delay=[0.02,0.4]",
    "perturbation.pushes=[5.0,100.0]",
    "perturbation.push_time=0.2",
    "success.duration=3.0",
    "success.place_time=2.5",
]


def write_policy(file, factor=1.0, limit=20.0):
    gain = factor * np.array([-50.0, -10.0, -14.0, -12.0])
    save_checkpoint(file, "policy", LinearPolicy(NAMES, gain, 0.0, limit).to_payload())


def write_run(folder, seed=880, factor=1.0, link=None):
    """A run folder with all that is read of it."""
    (folder / ".hydra").mkdir(parents=True)
    (folder / "summary.json").write_text(json.dumps(summary([10], 1.0, seed)))
    virtual = {"robot": "${robot.name}", "seed": seed, "overrides": ["idle_timeout=300", "faults=moderate"]}
    (folder / ".hydra" / "config.yaml").write_text(json.dumps({"robot": {"name": "paper"}, "link": link or virtual}))
    write_policy(folder / "best_policy.pt", factor)


@pytest.fixture
def runs(tmp_path):
    write_run(tmp_path / "good" / "a")
    write_run(tmp_path / "late" / "a", factor=4.0)
    return tmp_path


def compare(runs, out, *words):
    return main(["compare", f"runs={runs}", f"hydra.run.dir={out}", *QUICK, *words])


def refused(capsys):
    (said,) = capsys.readouterr().err.splitlines()
    return said


@pytest.mark.slow
def test_policies_of_runs_are_driven_and_shown(runs, tmp_path, capsys):
    out = tmp_path / "out"
    assert compare(f"{{good:{runs / 'good'},late:{runs / 'late'}}}", out) == 0
    said = capsys.readouterr().out
    assert "driven to learn until all trials succeed" in said  # the comparison of runs is as it was
    found = read_record(Robustness, out / "robustness.json")
    assert [(m.name, [p.seed for p in m.policies]) for m in found.methods] == [("good", [880]), ("late", [880])]
    good, late = found.methods
    assert (good.unchanged(), good.shares("delay"), good.shares("pushes")) == (1.0, [1.0, 0.0], [1.0, 0.0])
    assert late.overall() < good.overall()
    assert [axis.name for axis in found.axes][-2:] == ["delay", "pushes"]
    page, drawn = (out / "robustness.html").read_text(), (out / "robustness.svg").read_text()
    assert "<svg" in page
    assert "WARNING" not in page
    for name in ("good", "late", "model error", "pushes"):
        assert name in page
        assert f">{name}<" in drawn
    assert [line.split()[0] for line in said.splitlines() if line.count("\u00a0%") > 1] == ["good", "late"]


@pytest.mark.slow
def test_what_was_driven_is_not_driven_again(runs, tmp_path, capsys):
    out, made = tmp_path / "out", {}
    for go in range(2):
        assert compare(f"[{runs / 'good'}]", out) == 0
        assert ("best_policy.pt on paper 880" in capsys.readouterr().out) == (go == 0)
        made[go] = [(out / f"robustness.{ending}").read_bytes() for ending in ("json", "svg", "html")]
    assert made[0] == made[1]
    assert compare(f"[{runs / 'good'}]", out, "perturbation.delay=[0.03]") == 1
    assert "holds the work of other settings" in capsys.readouterr().err


@pytest.mark.slow
def test_another_folder_gets_the_same_bytes(runs, tmp_path):
    made = []
    for out in (tmp_path / "out", tmp_path / "other"):
        assert compare(f"[{runs / 'good'}]", out) == 0
        made.append((out / "robustness.json").read_bytes())
    assert made[0] == made[1]


@pytest.mark.slow
def test_policy_files_are_driven_on_the_robot_that_the_command_chooses(runs, tmp_path):
    file = runs / "good" / "a" / "best_policy.pt"
    assert compare(f"[{runs / 'good'}]", tmp_path / "run") == 0
    words = ["link.seed=880", 'link.overrides=["faults=moderate"]']
    assert compare(f"{{good:{file}}}", tmp_path / "file", *words) == 0
    record = [(tmp_path / each / "robustness.json").read_bytes() for each in ("run", "file")]
    assert record[0] == record[1]
    assert not (tmp_path / "file" / "comparison.html").exists()


@pytest.mark.slow
def test_the_unchanged_robot_is_the_one_behind_the_serial_port(runs, tmp_path):
    """Trials of `real-rollout`, through the protocol, are judged as those that are driven directly."""
    from twbal.cli.artefacts import read_logs
    from twbal.core.evaluation import SuccessCriterion, judged

    out, file = tmp_path / "rollout", runs / "good" / "a" / "best_policy.pt"
    words = [f"policy.path={file}", "trials=2", "first_trial=2000", "steps=150", "link.seed=880"]
    words += ['link.overrides=["faults=moderate"]', "state.names=[tilt,tilt_rate,speed,position]"]
    assert main(["real-rollout", *words, f"hydra.run.dir={out}"]) == 0
    rule = SuccessCriterion(0.5236, 0.17453, 100, 150, 125, 1.0, 0.1, 0.15, 20.0)
    succeeded = sum(judged(episode, rule).succeeded for episode in read_logs([out]))
    assert compare(f"[{runs / 'good'}]", tmp_path / "out", "perturbation.trials=2") == 0
    (method,) = read_record(Robustness, tmp_path / "out" / "robustness.json").methods
    assert method.policies[0].unchanged.succeeded == succeeded


@pytest.mark.slow
def test_groups_on_other_robots_are_warned_of(runs, tmp_path, capsys):
    write_run(tmp_path / "other" / "a", seed=881)
    assert compare(f"[{runs / 'good'},{tmp_path / 'other'}]", tmp_path / "out") == 0
    assert "WARNING: the groups were not tried on the same robots" in capsys.readouterr().out
    assert "WARNING" in (tmp_path / "out" / "robustness.html").read_text()


def test_without_robustness_no_policy_is_read(runs, tmp_path):
    (runs / "good" / "a" / "best_policy.pt").unlink()
    assert main(["compare", f"runs=[{runs / 'good'}]", f"hydra.run.dir={tmp_path / 'out'}"]) == 0
    assert not (tmp_path / "out" / "robustness.json").exists()


def test_a_run_over_a_serial_port_cannot_be_changed(tmp_path, capsys):
    write_run(tmp_path / "real" / "a", link={"_target_": "x", "port": "/dev/ttyUSB0"})
    assert compare(f"[{tmp_path / 'real'}]", tmp_path / "out") == 1
    assert "was not a virtual one (link.port=/dev/ttyUSB0); only a virtual robot can be changed" in refused(capsys)


def test_a_policy_alone_needs_robustness(runs, tmp_path, capsys):
    file = runs / "good" / "a" / "best_policy.pt"
    assert main(["compare", f"runs=[{file}]", f"hydra.run.dir={tmp_path / 'out'}"]) == 1
    assert "policies alone are compared by robustness=true" in refused(capsys)


def test_a_policy_that_is_not_there_is_refused(tmp_path, capsys):
    assert compare(f"[{tmp_path / 'none.pt'}]", tmp_path / "out") == 1
    assert "none.pt. Give a policy.pt, or a run folder" in refused(capsys)


def test_a_policy_on_a_real_robot_is_refused(runs, tmp_path, capsys):
    file = runs / "good" / "a" / "best_policy.pt"
    assert compare(f"[{file}]", tmp_path / "out", "link=serial", "link.port=/dev/ttyUSB0") == 1
    assert "Only a virtual robot can be changed: choose link=virtual" in refused(capsys)


@pytest.mark.parametrize(
    ("lost", "complaint"), [("best_policy.pt", "has no best_policy.pt"), (".hydra/config.yaml", "which robot")]
)
def test_a_run_that_lacks_a_part_is_refused(lost, complaint, runs, tmp_path, capsys):
    (runs / "good" / "a" / lost).unlink()
    assert compare(f"[{runs / 'good'}]", tmp_path / "out") == 1
    assert complaint in refused(capsys)


@pytest.mark.parametrize(
    "word",
    ["faults._target_=os.system", "+faults.x=1", "hydra.searchpath=[/tmp]", "faults.delay=${oc.env:HOME}", "nonsense"],
)
def test_a_configuration_that_may_come_from_anyone_names_no_code(word, tmp_path, capsys):
    link = {"robot": "paper", "seed": 880, "overrides": [word]}
    write_run(tmp_path / "run" / "a", link=link)
    assert compare(f"[{tmp_path / 'run'}]", tmp_path / "out") == 1
    assert "which is not taken here. Expected are settings of robot, faults, start" in refused(capsys)


def test_a_robot_that_there_is_not_is_one_clear_line(tmp_path, capsys):
    write_run(tmp_path / "run" / "a", link={"robot": "nobody", "seed": 1, "overrides": []})
    assert compare(f"[{tmp_path / 'run'}]", tmp_path / "out") == 1
    assert "nobody" in refused(capsys)


def test_a_policy_that_commands_more_than_the_robot_takes_is_refused(runs, tmp_path, capsys):
    write_policy(tmp_path / "strong.pt", limit=50.0)
    assert compare(f"[{tmp_path / 'strong.pt'}]", tmp_path / "out") == 1
    assert "commands up to 50 N·m" in refused(capsys)
