"""Episodes that a stage is not meant to learn from, and an agent that nothing would use, are said or refused."""

import pytest

from twbal.cli.main import main

pytestmark = pytest.mark.usefixtures("as_from_a_shell")
FEW = ["rollouts=2", "steps=60", "workers=1"]


@pytest.fixture
def simulated():
    assert main(["sim-collect", *FEW, "hydra.run.dir=simulated"]) == 0
    return "simulated"


def test_a_regulator_is_not_made_of_another_robots_episodes(simulated, capsys):
    assert main(["lqr", f"episodes={simulated}", "robot=balboa", "hydra.run.dir=regulator"]) == 1
    assert "is an episode of the robot 'paper'; expected is 'balboa'" in capsys.readouterr().err
    assert main(["lqr", f"episodes={simulated}", "hydra.run.dir=regulator"]) == 0


def test_a_correction_that_is_learned_from_simulated_episodes_is_doubted(simulated, capsys):
    assert main(["fit-diff-gp", f"episodes={simulated}", "dynamics=null", "hydra.run.dir=g"]) == 0
    assert "WARNING: 2 of 2 episodes are of a simulation. g is to be learned from" in capsys.readouterr().out


def test_an_agent_that_nothing_would_use_is_refused(capsys):
    assert main(["iterate", "trained_agent=nowhere", "hydra.run.dir=run"]) == 1
    said = capsys.readouterr()
    assert "here comes from initial_policy=simulation (method=twbal). Leave trained_agent=... out" in said.err
    assert said.out == ""
