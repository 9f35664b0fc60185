"""A robot on a port whose firmware has another name than its sheet: its recordings are those of the sheet's robot."""

from contextlib import closing

import pytest

from twbal.cli.main import main
from twbal.virtual_robot.process import VirtualRobotProcess, virtual_robot_command

PATIENCE = 60.0  # s


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """The run folder of a rollout with the sheet `paper`."""
    folder = tmp_path_factory.mktemp("firmware_name")
    with closing(VirtualRobotProcess.ready(virtual_robot_command(["robot.name=its_firmware"]), PATIENCE)) as robot:
        reached = ["link=serial", f"link.port={robot.port}", "link.confirm_placed=null"]
        words = ["experiment=excite", "trials=1", "steps=120", "policy.command_width=0.1", f"hydra.run.dir={folder}"]
        assert main(["real-rollout", *reached, *words]) == 0
    return folder


@pytest.fixture(autouse=True)
def arguments(monkeypatch):
    """Hydra reads them."""
    monkeypatch.setattr("sys.argv", ["twbal"])


@pytest.mark.slow
def test_it_is_identified_and_its_simulation_evaluated(recorded, tmp_path, capsys):
    out = tmp_path / "identified"
    assert main(["identify", f"episodes={recorded}", f"hydra.run.dir={out}"]) == 0
    sims = f"sims=[nominal,{out / 'identified.yaml'}]"
    evaluated = f"hydra.run.dir={tmp_path / 'evaluated'}"
    assert main(["evaluate-sim", sims, f"episodes={recorded}", "settling=0.1", evaluated]) == 0
    said = capsys.readouterr().out
    assert "not told apart on 0, without an interval on 1, as the recording is too short for one" in said


def test_it_is_not_the_robot_of_another_sheet(recorded, tmp_path, capsys):
    out = f"hydra.run.dir={tmp_path / 'identified'}"
    for command in ("identify", "diagnose"):
        assert main([command, "robot=regbot", f"episodes={recorded}", out]) == 1
        assert (
            "is an episode of the robot 'its_firmware', recorded with the sheet 'paper'; expected is 'regbot'"
            in capsys.readouterr().err
        )


def test_a_period_of_another_sheet_is_refused(recorded, tmp_path, capsys):
    out = f"hydra.run.dir={tmp_path / 'identified'}"
    assert main(["identify", "robot.control_period=0.03", f"episodes={recorded}", out]) == 1
    assert "set its period by robot.control_period=0.02" in capsys.readouterr().err


def test_a_recording_that_is_given_twice_is_said_to_count_twice(recorded, tmp_path, capsys):
    out = f"hydra.run.dir={tmp_path / 'identified'}"
    assert main(["identify", f"episodes=[{recorded},{recorded}]", out]) == 0
    assert "WARNING" in (said := capsys.readouterr().out)
    assert "is the same recording as" in said
