"""`twbal new-robot` on the command line: a sheet that other commands find, and answers that outlive Ctrl-C."""

import io
import shlex
import sys

import pytest
import yaml

from twbal.cli.main import main

pytestmark = pytest.mark.usefixtures("as_from_a_shell")
ANSWERS = {
    **{"control_period": "100 Hz", "wheel_mass": "35 g", "body_mass": "1.09 kg; parts", "wheel_radius": "34 mm"},
    **{"wheel_width": "26 mm", "track": "0.25", "com_height": "7.59 cm", "com_offset": "0 guess"},
    **{"wheel_inertia": "disk", "body_inertia_pitch": "3.77e-3", "body_inertia_roll": "6.62e-3"},
    **{"body_inertia_yaw": "4.4e-3 computed", "torque_limit": "0.98 guess"},
}


class Terminal(io.StringIO):
    """Keys pressed at a terminal; behind them Ctrl-D."""

    def isatty(self):
        return True


def words(answers):
    return [f'given.{key}="{value}"' for key, value in answers.items()]


def test_answers_of_words_and_of_a_file_make_a_sheet_that_other_commands_find(tmp_path, capsys):
    by_word = {key: ANSWERS[key] for key in ("body_mass", "track")}
    rest = {key: text for key, text in ANSWERS.items() if key not in by_word} | {"track": "9 m"}  # the word counts
    (tmp_path / "answers.yaml").write_text(yaml.safe_dump(rest))
    assert main(["new-robot", "name=my_robot", "answers=answers.yaml", *words(by_word)]) == 0
    said = capsys.readouterr().out
    assert "next  twbal lqr --config-dir=my_conf robot=my_robot" in said
    assert main(["lqr", "--config-dir=my_conf", "robot=my_robot", "--cfg", "job"]) == 0
    robot = yaml.safe_load(capsys.readouterr().out)["robot"]
    assert (robot["name"], robot["body_mass"], robot["track"], robot["wheel_radius"]) == ("my_robot", 1.09, 0.25, 0.034)
    assert main(["lqr", "--config-dir=my_conf", "robot=my_robot", "hydra.run.dir=out"]) == 0
    assert main(["new-robot", "name=my_robot", "answers=answers.yaml"]) == 1
    assert "There is a sheet my_conf/robot/my_robot.yaml already" in capsys.readouterr().err
    assert main(["new-robot", "name=my_robot", "replace=true", "given.track=0.3"]) == 0  # from the kept answers
    assert yaml.safe_load((tmp_path / "my_conf" / "robot" / "my_robot.yaml").read_text())["track"] == 0.3


def test_a_folder_with_a_blank_is_quoted_for_the_shell(capsys):
    assert main(["new-robot", "name=mine", "folder=my conf", *words(ANSWERS)]) == 0
    following = capsys.readouterr().out.split("next  ")[1]
    assert shlex.split(following) == ["twbal", "lqr", "--config-dir=my conf", "robot=mine"]
    assert main([*shlex.split(following)[1:], "hydra.run.dir=out"]) == 0


def test_who_ends_it_goes_on_with_the_same_command(tmp_path, monkeypatch, capsys):
    lines = list(ANSWERS.values())
    monkeypatch.setattr(sys, "stdin", Terminal("\n".join([*lines[:3], ""])))
    assert main(["new-robot", "name=mine"]) == 130
    assert "answers so far are in my_conf/robot/mine.answers" in capsys.readouterr().out
    assert not (tmp_path / "my_conf" / "robot" / "mine.yaml").exists()
    monkeypatch.setattr(sys, "stdin", Terminal("\n".join([*lines[3:], ""])))
    assert main(["new-robot", "name=mine"]) == 0
    assert "# kg; parts" in (tmp_path / "my_conf" / "robot" / "mine.yaml").read_text()


def test_who_ends_it_at_once_is_not_told_of_a_file_of_answers(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdin", Terminal(""))
    assert main(["new-robot", "name=mine"]) == 130
    said = capsys.readouterr().out
    assert "No answers were given" in said and "answers so far" not in said


def test_what_is_doubted_of_a_sheet_is_told_when_it_is_written(capsys):
    doubted = {**ANSWERS, "wheel_radius": "0.006 m", "track": "0.15", "wheel_width": "5 mm"}
    assert main(["new-robot", "name=mine", *words(doubted)]) == 0
    assert "WARNING: wheel_radius of robot 'mine' is 0.006 m; expected 0.008 to 0.5 m" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["name=paper"], "twbal has a robot 'paper' of its own"),
        (["name=../x"], "cannot be called '../x'"),
        (["name=m"], "The sheet of m lacks control_period, wheel_mass"),
        (["name=m", "given.com_height=75.9"], "Is it in mm? Then write `75.9 mm`"),
        (["name=m", "answers=none.yaml"], "There is no file none.yaml of answers"),
        (["name=m", "given.colour=red"], "has no setting 'given.colour'"),
    ],
)
def test_what_cannot_be_is_one_clear_error(given, said, monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    assert main(["new-robot", *given]) == 1
    error = capsys.readouterr().err
    assert said in error
    assert error.count("twbal: error:") == 1


def test_impossible_inertias_write_no_sheet(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    assert main(["new-robot", "name=m", *words({**ANSWERS, "body_inertia_yaw": "0.012"})]) == 1
    assert "which no body has" in capsys.readouterr().err
    assert not (tmp_path / "my_conf" / "robot" / "m.yaml").exists()
