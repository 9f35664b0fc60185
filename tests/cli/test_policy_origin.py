"""What a run folder tells of the robot that its policy was made for is held against the robot that is to be driven."""

import shutil
from pathlib import Path

import numpy as np
import pytest

import twbal
from twbal.cli.main import main
from twbal.cli.policy_origin import with_control_period
from twbal.core.errors import ConfigError
from twbal.io.checkpoint import save_checkpoint
from twbal.policies import saved
from twbal.policies.linear import LinearPolicy

ROOT = Path(__file__).parents[2]
REGRESSION = ROOT / "data" / "regression" / "policy.pt"


@pytest.fixture(scope="module")
def regulator(tmp_path_factory):
    """A policy that an earlier version may have made for a robot of 0.015 s: its file does not tell the period."""
    folder = tmp_path_factory.mktemp("regbot")
    assert main(["lqr", "robot=regbot", "state=rolling", f"hydra.run.dir={folder}"]) == 0
    assert saved.load_policy(folder / "policy.pt").control_period is None
    return folder / "policy.pt"


def test_the_folder_tells_the_control_period_and_a_file_that_is_saved_anew_does_too(regulator, tmp_path):
    policy = twbal.load_policy(regulator)
    assert policy.control_period == 0.015
    twbal.save_policy(tmp_path / "copy.pt", policy)
    assert saved.load_policy(tmp_path / "copy.pt").control_period == 0.015


def test_a_folder_tells_nothing_of_a_file_that_it_did_not_make(regulator, tmp_path):
    shutil.copytree(regulator.parent, tmp_path / "other")
    file = tmp_path / "other" / "policy.pt"
    other = LinearPolicy(("tilt",), np.ones(1), 0.0, 1.0)
    save_checkpoint(file, "policy", other.to_payload())
    assert with_control_period(other, file).control_period is None
    (tmp_path / "other" / "manifest.json").write_text("{}")
    assert with_control_period(other, file).control_period is None
    assert with_control_period(other, tmp_path / "copy.pt").control_period is None


@pytest.mark.parametrize("stage", ["sim-collect", "real-rollout", "export-policy"])
def test_a_command_refuses_a_policy_of_another_control_period(stage, regulator, as_from_a_shell, capsys):
    weak = ["robot=paper", "robot.torque_limit=0.49", "state=rolling"]
    more = ["rollouts=1", "steps=3", "policy=saved"] if stage == "sim-collect" else []
    assert main([stage, *weak, *more, f"policy.path={regulator}", "hydra.run.dir=out"]) == 1
    assert "made for a control period of 0.015 s; the robot 'paper' has one of 0.02 s" in capsys.readouterr().err


def test_a_command_warns_of_a_policy_of_a_much_weaker_robot(regulator, as_from_a_shell, capsys):
    words = ["robot.control_period=0.015", "state=rolling", "policy=saved", f"policy.path={regulator}"]
    assert main(["sim-collect", *words, "rollouts=1", "steps=3", "hydra.run.dir=out"]) == 0
    said = capsys.readouterr().out
    assert said.count("WARNING: The policy commands up to 0.49 N·m; the torque limit of the robot 'paper' is 20") == 1


@pytest.mark.parametrize("stage", ["sim-collect", "export-policy"])
@pytest.mark.parametrize(
    ("words", "warns"),
    [(["robot=regbot"], False), (["robot=balboa", "robot.control_period=0.015"], True)],
    ids=["its own robot", "another robot"],
)
def test_a_command_warns_of_a_policy_of_another_robot(stage, words, warns, regulator, as_from_a_shell, capsys):
    """Its place and speed are worked out by the radius of the wheels."""
    more = ["rollouts=1", "steps=3", "policy=saved"] if stage == "sim-collect" else []
    given = [*words, *more, "state=rolling", f"policy.path={regulator}", "hydra.run.dir=out"]
    assert main([stage, *given]) == 0
    said = capsys.readouterr().out
    assert ("was made for the robot 'regbot', with a wheel radius of 0.03 m." in said) == warns


@pytest.mark.parametrize("kind", ["path", "policy"])
def test_the_library_refuses_a_policy_of_another_control_period(kind, regulator, tmp_path):
    policy = regulator if kind == "path" else twbal.load_policy(regulator)
    for use in (
        lambda: twbal.simulate("upkie", policy, steps=3),
        lambda: twbal.evaluate(policy, "upkie", trials=1),
        lambda: twbal.export_policy(policy, tmp_path, "upkie"),
    ):
        with pytest.raises(ConfigError, match=r"control period of 0\.015 s; the robot 'upkie' has one of 0\.005 s"):
            use()
    assert len(twbal.simulate("regbot", policy, steps=3)) == 1


def test_a_policy_of_the_regression_data_does_not_drive_another_robot():
    with pytest.raises(ConfigError, match=r"control period of 0\.02 s; the robot 'upkie' has one of 0\.005 s"):
        twbal.simulate("upkie", REGRESSION, steps=100)


def test_the_library_warns_of_a_policy_that_tells_no_control_period():
    unknown = LinearPolicy(("tilt", "tilt_rate", "speed", "command_1", "command_2"), np.zeros(5), 0.0, 20.0)
    with pytest.warns(UserWarning) as caught:
        twbal.simulate("upkie", unknown, steps=3)
    said = [str(one.message) for one in caught]
    assert len(said) == 2
    assert "The policy commands up to 20 N·m; the torque limit of the robot 'upkie' is 3.4 N·m" in said[0]
    assert "The policy reads 2 past commands; the state of the robot 'upkie' has 8" in said[1]
    assert {one.filename for one in caught} == {__file__}  # the line that called the library
