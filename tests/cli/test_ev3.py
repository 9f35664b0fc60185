"""The log of an EV3 segway, where it is: what the import proposes, and what a person has to add (docs/ev3.md)."""

from pathlib import Path

import pytest
import yaml

from twbal.cli.main import main

ROOT = Path(__file__).resolve().parents[2]
LOG = ROOT.parent / "shared" / "measured" / "segway_ev3" / "datalog.json"
OURS = ROOT / "data" / "ev3"

pytestmark = pytest.mark.skipif(not LOG.is_file(), reason="the measured log is not there")


@pytest.fixture(autouse=True)
def arguments(monkeypatch):
    """Hydra reads them."""
    monkeypatch.setattr("sys.argv", ["twbal"])


def read(file):
    told = yaml.safe_load(file.read_text())
    return {**told.pop("quantities"), **told}


def test_the_proposal_needs_two_edits(tmp_path):
    assert main(["import-log", "guess=true", f"files={LOG}", f"hydra.run.dir={tmp_path}"]) == 0
    proposed, ours = read(tmp_path / "import" / "my_log.yaml"), read(OURS / "import" / "ev3.yaml")
    assert set(proposed) == set(ours)
    assert {key for key in ours if ours[key] != proposed[key]} == {"motor", "tilt"}


def test_the_proposal_has_the_motor_where_the_robot_is_known(tmp_path):
    words = [f"--config-dir={OURS}", "robot=ev3", f"files={LOG}", f"hydra.run.dir={tmp_path}"]
    assert main(["import-log", "guess=true", *words]) == 0
    proposed, ours = read(tmp_path / "import" / "my_log.yaml"), read(OURS / "import" / "ev3.yaml")
    assert ours["tilt"].pop("scale") == pytest.approx(1.03, abs=0.01)
    assert proposed == ours


def test_the_log_is_imported_and_nothing_is_doubted(tmp_path, capsys):
    words = [f"--config-dir={OURS}", "import=ev3", "robot=ev3", f"files={LOG}", f"hydra.run.dir={tmp_path}"]
    assert main(["import-log", *words]) == 0
    said = capsys.readouterr().out
    assert "1 recording, 15.4 s at 32.26 Hz" in said
    assert not [line for line in said.splitlines() if "WARNING" in line and "imported before" not in line]
