"""A robot may be named by the path of its sheet, as in the library."""

import shlex
from pathlib import Path

import pytest

from twbal.cli.main import main
from twbal.cli.robot_words import with_sheet_folder
from twbal.core.errors import ConfigError

PACKAGED = Path(__file__).parents[2] / "conf" / "robot"


@pytest.fixture
def sheet(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = Path("my_conf", "robot", "mine.yaml")
    path.parent.mkdir(parents=True)
    path.write_text((PACKAGED / "balboa.yaml").read_text().replace("name: balboa", "name: mine"))
    return path


def test_a_sheet_is_a_choice_of_its_folder(sheet):
    chosen = ["robot=mine", "seed=1", "--config-dir=my_conf"]
    assert with_sheet_folder([f"robot={sheet}", "seed=1"]) == chosen
    assert with_sheet_folder([f"robot={sheet}", "seed=1", "--config-dir=my_conf"]) == chosen
    absolute = [f"robot={sheet.resolve()}", "-cd", "my_conf"]
    assert with_sheet_folder(absolute) == ["robot=mine", "-cd", "my_conf"]
    assert with_sheet_folder([f"robot='{sheet}'", "seed=1"]) == chosen
    other = sheet.rename(sheet.with_name("über.yaml"))
    assert with_sheet_folder([f'robot="{other}"', "-cd=my_conf"]) == ["robot='über'", "-cd=my_conf"]
    assert with_sheet_folder(chosen) == chosen
    assert with_sheet_folder(["sim=a.yaml", "robot=paper"]) == ["sim=a.yaml", "robot=paper"]


def test_of_several_robots_those_by_path_are_choices_of_their_folder(sheet):
    chosen = ["-m", "robot=mine,paper", "--config-dir=my_conf"]
    assert with_sheet_folder(["-m", f"robot={sheet},paper"]) == chosen
    assert with_sheet_folder(["-m", f"robot='{sheet}',\"paper\""]) == chosen
    assert with_sheet_folder(["-m", f"robot=choice({sheet},paper)"]) == chosen
    other = sheet.with_name("its.yaml")
    other.write_text(sheet.read_text())
    assert with_sheet_folder(["-m", f"robot={sheet},{other}"]) == ["-m", "robot=mine,its", "--config-dir=my_conf"]
    comma = sheet.rename(sheet.with_name("a,b.yaml"))
    assert with_sheet_folder([f"robot={comma}"]) == ["robot='a,b'", "--config-dir=my_conf"]
    assert with_sheet_folder(["-m", "robot=mine,paper"]) == ["-m", "robot=mine,paper"]


def test_a_sweep_goes_over_sheets_by_their_paths(sheet, capsys):
    assert main(["lqr", "-m", f"robot={sheet},paper", "hydra.sweep.dir=sweep"]) == 0
    assert len(list(Path("sweep").glob("robot-*/policy.pt"))) == 2
    assert main(["lqr", f"robot={sheet},paper"]) == 1
    assert "'robot=mine,paper' has several values" in capsys.readouterr().err


def test_sheets_of_two_folders_are_refused(sheet):
    other = Path("their_conf", "robot", "theirs.yaml")
    other.parent.mkdir(parents=True)
    other.write_text(sheet.read_text())
    with pytest.raises(ConfigError, match="lie in two folders, and Hydra takes a single --config-dir"):
        with_sheet_folder(["-m", f"robot={sheet},{other}"])
    with pytest.raises(ConfigError, match=r"There is no robot sheet none\.yaml"):
        with_sheet_folder(["-m", f"robot={sheet},none.yaml"])


def test_its_values_are_those_of_the_file_and_the_next_command_finds_it_too(sheet, capsys):
    assert main(["lqr", f"robot={sheet}", "hydra.run.dir=by_path"]) == 0
    said = capsys.readouterr().out
    assert f"--config-dir={sheet.parents[1].resolve()}" in said and "robot=mine" in said
    assert main(["lqr", "--config-dir=my_conf", "robot=mine", "hydra.run.dir=by_name"]) == 0
    assert Path("by_path/policy.pt").read_bytes() == Path("by_name/policy.pt").read_bytes()


def test_the_next_command_has_the_search_path_that_was_given(sheet, capsys):
    assert main(["lqr", f"hydra.searchpath=['file://{Path.cwd()}/my_conf']", "robot=mine", "hydra.run.dir=out"]) == 0
    (following,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("next ")]
    assert f"hydra.searchpath=['file://{Path.cwd()}/my_conf']" in shlex.split(following)


@pytest.mark.parametrize(
    ("place", "words", "said"),
    [
        ("none.yaml", [], "no robot sheet none.yaml.*twbal new-robot"),
        ("gone/mine.yaml", [], "no robot sheet gone/mine.yaml; .*: give robot=my_conf/robot/mine.yaml"),
        ("gone/mine.yaml", ["--config-dir=my_conf"], "; there is .*: give robot=mine beside --config-dir=my_conf"),
        ("gone/paper.yaml", [], "; twbal has a robot of that name: give robot=paper."),
        ("mine.yaml", [], "cannot be chosen where it lies.*robot=my_conf/robot/mine.yaml"),
        ("my_conf/robot/mine.yml", [], "cannot be chosen where it lies"),
        ("my_conf/robot/balboa.yaml", [], "file name of a packaged robot"),
        ("my_conf/robot/mine.yaml", ["--config-dir=other"], "not in other, and Hydra takes a single --config-dir"),
        ("my_conf/robot/mine.yaml", ["--config-dir", "other"], "not in other"),
    ],
)
def test_what_cannot_be_chosen_is_refused_with_what_to_do(sheet, place, words, said):
    if not place.startswith(("none", "gone")):
        Path(place).write_text(sheet.read_text())
    with pytest.raises(ConfigError, match=said):
        with_sheet_folder([f"robot={place}", *words])
