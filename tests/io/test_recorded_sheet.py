"""For which sheet a log was recorded."""

from dataclasses import asdict

import pytest
import yaml

from twbal.core.episode import Provenance
from twbal.core.robot_parameters import RobotParameters
from twbal.io.recorded_sheet import is_of_sheet, recorded_robot, robot_in_words

CONFIG = "robot:\n  name: mine\n  body_mass: 1.0\nsteps: 3\n"


def test_a_log_is_of_the_sheet_of_its_name():
    assert is_of_sheet(Provenance("paper", "simulation"), "paper")
    assert not is_of_sheet(Provenance("paper", "simulation"), "regbot")


def test_a_robot_on_a_link_is_of_the_sheet_that_it_was_recorded_with():
    provenance = Provenance("esp32", "robot", config=CONFIG)
    assert is_of_sheet(provenance, "mine")
    assert is_of_sheet(provenance, "esp32")
    assert not is_of_sheet(provenance, "paper")


def test_a_simulation_is_only_of_its_own():
    assert not is_of_sheet(Provenance("paper", "simulation", config=CONFIG), "mine")


@pytest.mark.parametrize(
    "config", ["", "robot", "- robot", "robot: mine", "robot: {name: 3}", "robot: [", "a: &a [*a]", "[" * 5000, "!!x y"]
)
def test_a_configuration_that_says_no_sheet_is_no_error(config):
    provenance = Provenance("esp32", "robot", config=config)
    assert not is_of_sheet(provenance, "mine")
    assert recorded_robot(provenance) is None


def test_a_log_says_the_whole_robot_that_it_was_recorded_with(paper: RobotParameters):
    sheet = {"_target_": "some.where", **asdict(paper)}
    assert recorded_robot(Provenance("esp32", "robot", config=yaml.dump({"robot": sheet}))) == paper
    for wrong in ({"body_mass": -1.0}, {"body_mass": "heavy"}, {"body_mass": None}, {"name": 3}):
        assert recorded_robot(Provenance("esp32", "robot", config=yaml.dump({"robot": sheet | wrong}))) is None


def test_errors_name_the_sheet_beside_the_robot():
    assert robot_in_words(Provenance("esp32", "robot", config=CONFIG)) == "'esp32', recorded with the sheet 'mine'"
    assert robot_in_words(Provenance("paper", "robot")) == "'paper'"
