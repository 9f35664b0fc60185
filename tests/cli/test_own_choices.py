"""A file of one's own has another name than the packaged choices of its group: Hydra would mix the two."""

from pathlib import Path

import pytest

import twbal
from twbal.cli.main import main
from twbal.cli.own_choices import refuse_packaged_names
from twbal.core.errors import ConfigError


@pytest.fixture
def own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def write(choice):
        path = Path("my_conf", f"{choice}.yaml")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("defaults: []\n")
        return path

    return write


@pytest.mark.parametrize(
    "choice",
    ["import/regbot", "sim/regbot", "experiment/excite", "model/fit_f/exact", "effect/dead_zone", "link/serial"],
)
@pytest.mark.parametrize(
    "words",
    [
        ["--config-dir=my_conf"],
        ["seed=1", "-cd", "my_conf"],
        ["--config-path", "my_conf"],
        ["hydra.searchpath=[other,my_conf]"],
        ["hydra.searchpath=['pkg://other','file://{cwd}/my_conf']"],
    ],
    ids=["dir", "short", "path", "searched", "url"],
)
def test_the_name_of_a_packaged_choice_is_refused(choice, words, own):
    own(choice)
    group, name = choice.rsplit("/", 1)
    said = (
        rf"my_conf/{choice}\.yaml has the name of a packaged choice, {group}={name}, .*Rename it, as to .*/my_{name}\."
    )
    with pytest.raises(ConfigError, match=said):
        refuse_packaged_names([word.format(cwd=Path.cwd()) for word in words])


def test_the_name_of_a_packaged_robot_is_refused_where_the_packaged_one_would_be_taken(own):
    own("robot/paper")
    for words in (["robot=paper", "--config-dir=my_conf"], ["hydra.searchpath=[my_conf]"]):
        with pytest.raises(ConfigError, match=r"my_conf/robot/paper\.yaml has the name of a packaged robot, robot=p"):
            refuse_packaged_names(words)
    refuse_packaged_names(["--config-path", "my_conf"])


def test_other_names_and_other_folders_are_not(own):
    for choice in ("import/my_regbot", "mine/regbot", "regbot", "robot/mine", "hydra/launcher/basic"):
        own(choice)
    words = ["--config-dir=my_conf", "hydra.searchpath=[gone,my_conf]", "hydra.searchpath=[", "-cd", "gone"]
    refuse_packaged_names(words)


@pytest.mark.parametrize("place", ["import/regbot", "sim/regbot"])
def test_a_command_ends_with_one_line_whether_the_choice_is_taken_or_not(place, own, capsys):
    own(place)
    assert main(["import-log", "--config-dir=my_conf", "import=columns", "files=a.csv", "hydra.run.dir=out"]) == 1
    said = capsys.readouterr()
    (line,) = said.err.splitlines()
    assert line.startswith(f"twbal: error: my_conf/{place}.yaml has the name of a packaged choice")
    assert not said.out and not Path("out").exists()


def test_the_folder_of_a_sheet_that_is_named_by_its_path_is_looked_through_too(own, capsys):
    own("sim/regbot")
    sheet = Path("my_conf", "robot", "mine.yaml")
    sheet.parent.mkdir()
    sheet.write_text("name: mine\n")
    assert main(["lqr", f"robot={sheet}", "hydra.run.dir=out"]) == 1
    assert "my_conf/sim/regbot.yaml has the name of a packaged choice" in capsys.readouterr().err


def test_so_it_is_in_python(own):
    own("sim/regbot")
    with pytest.raises(ConfigError, match=r"my_conf/sim/regbot\.yaml has the name of a packaged choice"):
        twbal.setup("paper", ["hydra.searchpath=[my_conf]"])
