"""A simulation may come from a file."""

import pytest

from twbal.cli import main
from twbal.errors import ConfigError
from twbal.stages.sim_files import with_files

GAIN = """
physics_step: 0.0005
effects:
  torque_gain:
    _target_: twbal.sim.effects.torque_gain.TorqueGain
    gain: 0.8
"""


@pytest.fixture
def augmented(tmp_path):
    path = tmp_path / "it's new" / "augmented.yaml"
    path.parent.mkdir()
    path.write_text(GAIN)
    return path


def test_a_stage_takes_the_simulation_that_a_file_says(augmented, capsys):
    assert main(["sim-collect", f"sim={augmented}", "--cfg", "job"]) == 0
    said = capsys.readouterr().out
    assert "physics_step: 0.0005" in said
    assert "_target_: twbal.sim.effects.torque_gain.TorqueGain\n      gain: 0.8" in said


def test_other_words_are_left_as_they_are():
    words = ["sim=nominal", "sim.physics_step=0.001", "policy.path=sim.yaml", "-m"]
    assert with_files(words) == words


@pytest.mark.parametrize(
    ("content", "complaint"),
    [("- 1\n", "it has list"), ("robot: 3\n", "it has robot"), ("a: [", "cannot be read"), ("effects: 3\n", "it has")],
)
def test_a_file_that_holds_no_simulation_is_refused(content, complaint, tmp_path):
    (tmp_path / "odd.yaml").write_text(content)
    with pytest.raises(ConfigError, match=complaint):
        with_files([f"sim={tmp_path / 'odd.yaml'}"])


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r"There is no simulation .*gone\.yaml"):
        with_files([f"sim={tmp_path / 'gone.yaml'}"])
