"""`twbal export-policy` as it is typed."""

import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from twbal.cli.main import main
from twbal.io.checkpoint import save_checkpoint
from twbal.policies.saved import load_policy

POLICY = Path(__file__).resolve().parents[2] / "data" / "regression" / "policy.pt"
needs_compiler = pytest.mark.skipif(not shutil.which("cc"), reason="there is no C compiler")


@pytest.fixture
def export(as_from_a_shell, capsys):
    def run(*words):
        code = main(["export-policy", f"policy.path={POLICY}", "state=rolling", "hydra.run.dir=out", *words])
        said = capsys.readouterr()
        return code, said.out, said.err

    return run


@needs_compiler
def test_it_writes_a_header_that_passes_its_own_test_and_says_what_it_takes(export, tmp_path):
    code, said, _ = export("states=500")
    assert code == 0
    assert "equal to the policy at 500 states" in said
    assert "ESP32" in said and "ATmega32U4" in said
    subprocess.run(["cc", "-std=c99", "-o", "selftest", "policy_selftest.c", "-lm"], cwd="out", check=True)
    assert subprocess.run(["out/selftest"]).returncode == 0
    found = json.loads(Path("out/on_board.json").read_text())
    assert found["agreement"]["max_of_bound"] < 1
    assert [need["board"] for need in found["needs"]] == ["ESP32", "ATmega32U4"]


def test_a_smaller_policy_says_what_it_costs_and_is_one_as_any_other(export):
    code, said, _ = export("states=0", "distil=5")
    assert code == 0
    assert "5 of 30 basis functions are left: the command differs by" in said
    assert "not compiled here" in said
    assert len(load_policy("out/policy.pt", ("tilt", "tilt_rate", "speed", "command_1", "command_2")).weights) == 5


@pytest.mark.parametrize(
    ("word", "said"),
    [("state=default", "Choose the state"), ("target=rust", "header")],
)
def test_what_cannot_be_done_is_refused_in_one_line(export, word, said):
    code, _, complaint = export(word, "states=0")
    assert code == 1
    assert said in complaint
    assert complaint.count("\n") == 1
    assert not Path("out/policy.h").exists()


def test_a_policy_without_as_many_functions_is_left_as_it_is(export):
    code, said, _ = export("states=0", "distil=30")
    assert code == 0
    assert "has no more than 30 basis functions with a weight: all are left" in said
    assert len(load_policy("out/policy.pt").weights) == 30


def test_no_next_command_is_printed_that_would_be_refused(export):
    code, said, _ = export("states=0")
    assert code == 0 and "next  twbal real-rollout policy.path=" in said
    code, said, _ = export("states=0", "robot.torque_limit=1", "hydra.run.dir=weak")
    assert code == 0 and "made  weak/" in said and "next " not in said
    assert "real-rollout would refuse it: The policy commands up to " in said
    assert main(["real-rollout", f"policy.path={POLICY}", "state=rolling", "robot.torque_limit=1"]) == 1


@needs_compiler
def test_where_it_does_not_fit_it_says_what_to_do(export):
    faster = replace(load_policy(POLICY), control_period=0.005)
    save_checkpoint(Path("faster.pt"), "policy", faster.to_payload())
    code, said, _ = export("states=100", "robot.control_period=0.005", "policy.path=faster.pt")
    assert code == 0
    assert "ATmega32U4: too much time (" in said
    assert "distil=<number>" in said
