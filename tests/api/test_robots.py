"""A robot of one's own is used by its sheet or its parameters wherever a packaged one is used by its name."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import twbal
from twbal.core.errors import ConfigError
from twbal.core.robot_parameters import RobotParameters

SHEET = Path(__file__).parents[2] / "data" / "ev3" / "robot" / "ev3.yaml"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder of one's own configuration in the working directory, with the sheet of a robot `wobbly`."""
    (tmp_path / "my_conf" / "robot").mkdir(parents=True)
    (tmp_path / "my_conf" / "cost").mkdir()
    text = re.sub(r"name: ev3", "name: wobbly", SHEET.read_text())
    (tmp_path / "my_conf" / "robot" / "wobbly.yaml").write_text(text)
    (tmp_path / "my_conf" / "cost" / "mine.yaml").write_text("{}")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("kind", [str, Path])
def test_a_sheet_is_read_by_its_path(folder, kind):
    own = twbal.robot(kind("my_conf/robot/wobbly.yaml"))
    assert (own.name, own.wheel_radius) == ("wobbly", 0.028)
    assert own.tolerance_factors["body_mass"] == twbal.robot(SHEET).tolerance_factors["body_mass"]


def test_a_path_and_its_parameters_are_the_same_robot(folder):
    path = "my_conf/robot/wobbly.yaml"
    by_path, by_parameters = (twbal.setup(robot).simulation.robot for robot in (path, twbal.robot(path)))
    assert by_path == by_parameters == twbal.robot(path)
    (first,), (second,) = (twbal.simulate(robot, steps=5) for robot in (path, twbal.robot(path)))
    np.testing.assert_array_equal(first.observations, second.observations)


def test_a_virtual_robot_is_that_of_ones_own_sheet(folder):
    own = replace(twbal.robot("my_conf/robot/wobbly.yaml"), torque_limit=0.5)
    with twbal.connect(None, own) as plant:
        assert plant.robot_name == "wobbly"
        assert plant.control_period == pytest.approx(own.control_period)
        assert plant.torque_limit == pytest.approx(0.5)


@pytest.mark.parametrize("use", [twbal.robot, twbal.setup, lambda name: twbal.connect(None, name)])
def test_the_name_of_ones_own_sheet_is_answered_by_what_to_do_in_python(folder, use):
    with pytest.raises(ConfigError, match=r"give its path, 'my_conf/robot/wobbly\.yaml'") as caught:
        use("wobbly")
    assert "--config-dir" not in str(caught.value)


def test_another_choice_of_ones_own_is_answered_by_an_override_that_works(folder):
    with pytest.raises(ConfigError, match=r"add 'hydra\.searchpath=\[my_conf\]' to the overrides"):
        twbal.setup("paper", ["cost=mine"])
    assert twbal.setup("my_conf/robot/wobbly.yaml", ["hydra.searchpath=[my_conf]", "cost=mine"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "There is no robot sheet sheet.yaml.*new-robot"),
        ("a: [", r"sheet\.yaml is no yaml: line 1"),
        ("- a", "holds no values by name"),
        ("name: a", "lacks its first entry"),
        ("defaults: [paper]", "Write its values out"),
        ("_target_: twbal.core.robot_sheet.robot_sheet\nname: a", "sheet.yaml cannot be used.*lacks body_mass"),
        ("_target_: twbal.core.robot_sheet.robot_sheet\nbodymass: 3", "did you mean 'robot.body_mass'"),
    ],
)
def test_what_is_no_sheet_is_one_clear_error(folder, text, message):
    if text is not None:
        Path("sheet.yaml").write_text(text)
    with pytest.raises(ConfigError, match=message):
        twbal.robot("sheet.yaml")


@pytest.mark.parametrize(
    ("robot", "found"),
    [(None, "found None"), (3, "found 3"), ("policy.pt", "swapped"), (RobotParameters, "found <class")],
)
def test_what_is_no_robot_is_one_clear_error(robot, found):
    for use in (twbal.robot, twbal.setup, twbal.simulate, lambda one: twbal.connect(None, one)):
        with pytest.raises(ConfigError, match=f"name of a packaged robot.*path of a sheet.*{found}"):
            use(robot)


def test_a_hardly_likely_value_of_a_sheet_is_a_warning():
    tall = replace(twbal.robot("esp32"), name="tall", com_height=7.0)
    with pytest.warns(UserWarning, match=r"com_height of robot 'tall' is 7 m; expected .* Is it in cm\?"):
        twbal.setup(tall)


def test_a_tolerance_factor_that_no_provenance_gives_is_refused():
    with pytest.raises(ConfigError, match=r"tolerance factor of body_mass must be one of 0\.5, 1, 2, 5; found 3"):
        twbal.setup(replace(twbal.robot(), tolerance_factors={"body_mass": 3.0}))
