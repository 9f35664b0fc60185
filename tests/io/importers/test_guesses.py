"""Several files: those that are mapped alike share a mapping, and what differs in others is said."""

import numpy as np
import pytest
from foreign_logs import columns, text

from twbal.cli.main import main
from twbal.io.importers.guess import guess
from twbal.io.importers.guesses import alike

ROWS = columns()[:, [0, 1, 5, 7]]


@pytest.fixture
def files(tmp_path):
    """Two logs that are alike, and one with its tilt in degrees and another name for the wheels."""
    made = []
    for name, rows, names in (
        ("a", ROWS, ("time", "tilt", "wheel_angle", "torque")),
        ("b", 0.5 * ROWS, ("time", "tilt", "wheel_angle", "torque")),
        ("c", ROWS * [1.0, 180 / np.pi * 2, 1.0, 1.0], ("time", "tilt", "encoder", "torque")),
    ):
        made.append(tmp_path / f"{name}.csv")
        made[-1].write_text(text(rows, names=names))
    return made


def test_files_that_are_mapped_alike_are_put_together_and_the_others_differences_are_told(files):
    first, second = alike([(path, guess(path)) for path in files])
    assert first.files == tuple(files[:2]) and first.differs == ()
    assert second.files == (files[2],)
    assert any(
        said.startswith("tilt: {from: tilt, unit: deg}; in a.csv: {from: tilt, unit: rad}") for said in second.differs
    )
    assert any(said.startswith("wheel_angle: {from: encoder") for said in second.differs)
    assert not any(said.startswith(("time", "command")) for said in second.differs)


def test_a_question_that_one_file_raises_is_asked_for_all_that_are_mapped_alike(files):
    told = [(path, guess(path)) for path in files]
    mapping = told[1][1].mapping.replace("is_sample: false", "is_sample: ???")
    doubtful = told[1][1]._replace(mapping=mapping, open=("loop?",))
    for order in ([told[0], (files[1], doubtful)], [(files[1], doubtful), told[0]]):
        (group,) = alike(order)
        assert group.files == (files[1], files[0]) and group.guess.open == ("loop?",) and group.differs == ()


def test_each_file_is_looked_at_and_one_that_cannot_be_read_spoils_none(files, tmp_path, capsys):
    (tmp_path / "bad.csv").write_text("a b\n1 x\nx 1\n")
    given = ",".join(map(str, [tmp_path / "bad.csv", *files]))
    assert main(["import-log", "guess=true", f"files=[{given}]", f"hydra.run.dir={tmp_path / 'out'}"]) == 1
    said, error = capsys.readouterr()
    assert "1 of 4 files cannot be read" in error and "bad.csv" in error
    assert "not looked at" in said and "bad.csv" in said and "the same mapping fits" in said
    assert "differs: tilt:" in said and "these files need 2 mappings" in said
    made = tmp_path / "out" / "import"
    assert (made / "my_log.yaml").exists() and (made / "my_log_2.yaml").exists()
    (tmp_path / "conf" / "import").mkdir(parents=True)
    (tmp_path / "conf" / "import" / "my_log.yaml").write_text("period: 0.02\n")
    words = [f"--config-dir={tmp_path / 'conf'}", "guess=true", f"files={files[0]}", f"hydra.run.dir={tmp_path / 'o'}"]
    assert main(["import-log", *words]) == 0
    assert [file.name for file in (tmp_path / "o" / "import").iterdir()] == [
        "my_log_2.yaml"
    ]  # the other would be found
    assert "import=my_log_2" in capsys.readouterr().out
    words = ["import-log", "guess=true", f"files={tmp_path / 'bad.csv'}", f"hydra.run.dir={tmp_path / 'none'}"]
    assert main(words) == 1
