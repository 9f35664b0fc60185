"""The training as a command: what it writes, who takes that, and what it refuses."""

import os
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="comes with the extra [rl]")

from twbal.cli.main import main
from twbal.cli.manifest import read_manifest
from twbal.io.checkpoint import load_checkpoint
from twbal.io.logs import read_episode
from twbal.policies.mlp import MlpPolicy
from twbal.policies.saved import load_policy

CHANNELS = ("tilt", "tilt_rate", "speed", "command_1", "command_2", "position", "position_integral")
QUICK = ["steps=64", "trials=2", "agent.options.n_steps=32", "agent.options.batch_size=16", "agent.hidden=[8]"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Holds a hardly trained agent in agent/."""
    folder, before = tmp_path_factory.mktemp("agent"), sys.argv
    try:
        assert main(["train-agent", f"hydra.run.dir={folder / 'agent'}", *QUICK]) == 0
    finally:
        sys.argv = before
    return folder


@pytest.fixture
def run(capsys, tmp_path):
    def command(stage, *words, out="out"):
        capsys.readouterr()
        code = main([stage, f"hydra.run.dir={tmp_path / out}", *map(str, words)])
        said = capsys.readouterr()
        return code, said.out, said.err

    return command


def test_the_same_command_gives_the_same_bytes_and_says_what_comes_next(folder, run, tmp_path):
    code, said, _ = run("train-agent", *QUICK)
    assert code == 0
    assert read_manifest(tmp_path / "out").outputs == read_manifest(folder / "agent").outputs
    judged, made, following = said.splitlines()
    assert judged.strip() in {f"{k} of 2 simulated trials succeed" for k in range(3)}
    assert made == f"made  {tmp_path / 'out' / 'policy.pt'}"
    assert following == f"next  twbal real-rollout policy.path={tmp_path / 'out' / 'policy.pt'}"


def test_simulation_and_robot_take_its_policy(folder, run, tmp_path):
    path = folder / "agent" / "policy.pt"
    policy = load_policy(path, CHANNELS)
    assert isinstance(policy, MlpPolicy)
    assert load_checkpoint(path, "policy")["law"] == "mlp"
    saved = ("policy=saved", f"policy.path={path}", "steps=10")
    for stage, words in (("sim-collect", (*saved, "rollouts=1")), ("real-rollout", saved)):
        assert run(stage, *words, out=stage)[0] == 0
        episode = read_episode(tmp_path / stage / "episodes" / "trial_000.mcap")
        np.testing.assert_allclose(episode.commands, policy.command(episode.states[:-1]), rtol=1e-12)


def test_a_weaker_robot_does_not_take_it(folder, run):
    words = ("robot=regbot", f"state.names=[{','.join(CHANNELS)}]", f"policy.path={folder / 'agent' / 'policy.pt'}")
    code, _, said = run("real-rollout", *words)
    assert code == 1
    assert "commands up to 20 N·m; the robot 'regbot' takes 0.49 N·m" in said


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["steps=0"], "steps=0; expected a whole number from 1"),
        (["trials=-1"], "trials=-1; expected a whole number from 0"),
        (["agent.algorithm=DQN"], "algorithm=DQN; expected one of: PPO, SAC"),
        (["agent=dqn"], "The choices are: ppo, sac."),
        (["agent.scales.tilt=0"], "agent.scales.tilt=0; expected a number"),
        (["+agent.options.speed=3"], "PPO of Stable-Baselines3 does not take agent.options"),
    ],
)
def test_what_cannot_be_meant_is_refused(words, message, run, tmp_path):
    code, _, said = run("train-agent", *QUICK, *words)
    assert code == 1
    assert message in said
    assert not (tmp_path / "out" / "policy.pt").exists()


def without(packages, words, folder):
    """Runs a command where `packages` are not installed."""
    lacks = f"sys.modules.update(dict.fromkeys({packages!r}))"
    code = f"import sys; {lacks}; from twbal.cli.main import main; sys.exit(main(sys.argv[1:]))"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", code, *words]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder, env=environment)


@pytest.mark.parametrize("lacking", ["gymnasium", pytest.param("stable_baselines3", marks=pytest.mark.slow)])
def test_without_the_extra_it_says_what_to_install(lacking, tmp_path):
    done = without([lacking], ["train-agent"], tmp_path)
    assert done.returncode == 1
    assert done.stderr.startswith("twbal: error: ")
    assert done.stderr.endswith("pip install -e '.[rl]' (in the checkout of twbal).\n")


@pytest.mark.slow
def test_iterate_does_not_need_the_extra(tmp_path):
    words = [
        "iterate",
        "method=lqr",
        "trials=1",
        "success.duration=0.1",
        "search.horizon=5",
        "success.settle_time=0.04",
        "success.place_time=0.1",
        f"hydra.run.dir={tmp_path}/out",
    ]
    assert without(["gymnasium", "stable_baselines3"], words, tmp_path).returncode == 0


@pytest.mark.slow
def test_nothing_else_needs_the_extra(folder, tmp_path):
    saved = ["policy=saved", f"policy.path={folder / 'agent' / 'policy.pt'}", "rollouts=1", "steps=5"]
    assert without(["gymnasium", "stable_baselines3"], ["sim-collect", *saved], tmp_path).returncode == 0


@pytest.mark.slow
@pytest.mark.parametrize("words", [["seed=1"], ["agent=sac", "steps=40000"]], ids=["ppo", "sac"])
def test_a_trained_agent_balances(words, run):
    code, said, _ = run("train-agent", *words)
    assert code == 0
    assert "10 of 10 simulated trials succeed" in said
