from dataclasses import replace

import pytest
import yaml

from twbal.cli.conf_folder import conf_folder
from twbal.core.errors import ConfigError
from twbal.core.robot_parameters import parameter_hash
from twbal.core.robot_sheet import VALUES, ValueProvenance, provenance_of, robot_sheet

ROBOTS = sorted(path.stem for path in (conf_folder() / "robot").glob("*.yaml"))


def sheet(name):
    found = yaml.safe_load((conf_folder() / "robot" / f"{name}.yaml").read_text())
    del found["_target_"]
    return found


@pytest.mark.parametrize("name", ROBOTS)
def test_each_packaged_robot_says_of_each_value_where_it_comes_from(name):
    values = sheet(name)
    assert values["name"] == name
    assert set(provenance_of(name, values["provenance"])) == set(VALUES) == set(values) - {"name", "provenance"}
    robot_sheet(**values)


@pytest.mark.parametrize(("name", "box"), [("paper", (0.15, 0.40, 0.60)), ("lego", (0.06, 0.09, 0.09))])
def test_inertias_of_a_box_are_those_of_the_box_that_the_sheet_states(name, box):
    values, (depth, width, height) = sheet(name), box
    for axis, one, other in (("pitch", depth, height), ("roll", width, height), ("yaw", depth, width)):
        expected = values["body_mass"] * (one**2 + other**2) / 12
        assert values[f"body_inertia_{axis}"] == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("axis", ["pitch", "roll", "yaw"])
@pytest.mark.parametrize("name", ROBOTS)
def test_inertias_in_kg_cm2_are_refused(name, axis):
    """All three, so that the inequality between them holds."""
    values = sheet(name)
    wrong = {f"body_inertia_{each}": 1e4 * values[f"body_inertia_{each}"] for each in ("pitch", "roll", "yaw")}
    with pytest.raises(
        ConfigError, match=f"body_inertia_pitch of robot '{name}' is .* expected at most .* other units"
    ):
        robot_sheet(**{**values, **wrong})


def test_a_body_as_wide_as_its_track_is_the_limit_across():
    values = sheet("paper")
    limit = values["body_mass"] * (4 * (0.3 + 0.15) ** 2 + 0.45**2)
    flat = {"body_inertia_pitch": 0.5, "body_inertia_roll": limit * 0.999, "body_inertia_yaw": limit * 0.999}
    robot_sheet(**{**values, **flat})
    with pytest.raises(ConfigError, match="body_inertia_roll"):
        robot_sheet(**{**values, **flat, "body_inertia_roll": limit * 1.001})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rumour": ["track"]}, "provenance 'rumour'; expected one of: measured, data_sheet, cad, computed, guess"),
        ({"measured": ["colour"]}, "lists 'colour' under provenance measured, and it is no value of a robot"),
        ({"measured": ["body_mass"]}, "lists 'body_mass' under provenance .*, and it is .* too"),
        ({"cad": []}, "does not say where these values come from: body_mass, com_height"),
    ],
)
def test_a_provenance_that_cannot_be_is_told(change, message):
    values = sheet("paper")
    with pytest.raises(ConfigError, match=message):
        robot_sheet(**{**values, "provenance": {**values["provenance"], **change}})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"name": None}, "has no name. Add `name"),
        ({"track": None, "wheel_mass": None}, "The sheet of robot 'paper' lacks wheel_mass, track. A sheet has"),
        ({"colour": 1.0}, "The sheet of robot 'paper' has colour, unknown here. A sheet has"),
        ({"provenance": None}, "does not say where these values come from: body_mass, .*control_period"),
    ],
)
def test_an_entry_that_is_missing_or_unknown_is_told(change, message):
    values = {key: value for key, value in {**sheet("paper"), **change}.items() if value is not None}
    with pytest.raises(ConfigError, match=message):
        robot_sheet(**values)


def test_where_values_come_from_changes_neither_the_robot_nor_its_hash(paper):
    measured = robot_sheet(**{**sheet("paper"), "provenance": {ValueProvenance.MEASURED: VALUES}})
    assert measured == paper == replace(paper, tolerance_factors={})
    assert measured.tolerance_factors != paper.tolerance_factors
    assert parameter_hash(measured) == parameter_hash(paper)
