"""The interview: every answer checked at once and kept, nothing lost, and a sheet that twbal takes."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from twbal.cli.settings.robot_settings import ROBOT
from twbal.core.errors import ConfigError
from twbal.core.robot_sheet import VALUES as SHEET
from twbal.core.robot_sheet import robot_sheet
from twbal.sheets.answer import answered
from twbal.sheets.interview import Interview, Person
from twbal.sheets.questions import QUESTIONS, VALUES
from twbal.sheets.writing import check_name, number, sheet_text, written_at_most

SHEETS = sorted((Path(__file__).resolve().parents[2] / "conf" / "robot").glob("*.yaml"))
ANSWERS = {
    **{"control_period": "100 Hz", "wheel_mass": "35 g", "robot_mass": "1.16", "body_mass": "less_wheels"},
    **{"wheel_radius": "ten_turns", "ten_turns_distance": "2.136", "wheel_width": "26 mm", "track": "0.25"},
    **{"com_height": "7.59 cm; balanced", "com_offset": "0 guess", "wheel_inertia": "disk"},
    **{"body_inertia_pitch": "swing", "swing_period": "0.62", "body_inertia_roll": "box", "body_inertia_yaw": "box"},
    **{"body_depth": "0.08", "body_width": "0.2", "body_height": "15 cm"},
    **{"torque_limit": "stall", "stall_torque": "5 kg·cm data sheet"},
}


def nobody():
    return Person(None, lambda line: None, lambda texts: None)


class Scripted:
    """A person who answers from a list, and ends it by Ctrl-C."""

    def __init__(self, *lines):
        self.lines, self.shown, self.kept = list(lines), [], {}

    def person(self):
        return Person(self.ask, self.shown.append, lambda texts: self.kept.update(texts))

    def ask(self, prompt):
        self.shown.append(prompt)
        if not self.lines:
            raise KeyboardInterrupt
        return self.lines.pop(0)


def values(text):
    tree = yaml.safe_load(text)
    assert tree.pop("_target_") == "twbal.core.robot_sheet.robot_sheet"
    return robot_sheet(**tree)


def test_given_answers_come_to_a_sheet_with_sources():
    text = sheet_text("mine", Interview("mine", ANSWERS, nobody()).run())
    robot = values(text)
    assert (robot.name, robot.control_period) == ("mine", 0.01)
    assert robot.body_mass == pytest.approx(1.16 - 2 * 0.035)
    assert robot.torque_limit == pytest.approx(2 * 5 * 9.80665e-2, rel=1e-5)
    assert "com_height: 0.0759 " in text
    assert "# m; balanced" in text
    tree = yaml.safe_load(text)["provenance"]
    assert {kind for kind, names in tree.items() if "com_offset" in names} == {"guess"}
    assert {"wheel_inertia", "body_inertia_pitch", "torque_limit"} <= set(tree["computed"])


@pytest.mark.parametrize("sheet", SHEETS, ids=lambda sheet: sheet.stem)
def test_the_numbers_of_every_packaged_robot_are_believed_and_come_back(sheet):
    tree = yaml.safe_load(sheet.read_text())
    texts = {key: f"{tree[key]!r} guess" for key in SHEET}
    robot = values(sheet_text("mine", Interview("mine", texts, nobody()).run()))
    assert {key: getattr(robot, key) for key in SHEET} == pytest.approx({key: float(tree[key]) for key in SHEET})


@pytest.mark.parametrize("sheet", SHEETS, ids=lambda sheet: sheet.stem)
@pytest.mark.parametrize(("unit", "slip"), [("m", "mm"), ("kg", "g"), ("s", "ms")])
def test_values_of_packaged_robots_in_a_thousandth_of_their_unit_are_told(sheet, unit, slip):
    tree = yaml.safe_load(sheet.read_text())
    for question in VALUES:
        if question.unit == unit:
            text = f"{tree[question.key] * 1000:.6g}"
            with pytest.raises(ConfigError, match=rf"Is it in \w+\? Then write `{text} \w+`\. If it is right"):
                answered(question, text, {})
            assert answered(question, f"{text} {slip}", {}).value == pytest.approx(float(tree[question.key]))


def test_no_length_mass_or_period_is_believed_in_a_thousandth_of_its_unit():
    checked = [question for question in QUESTIONS.values() if question.unit in ("m", "kg", "s")]
    assert len(checked) > 15
    assert all(question.high <= 1000.0 * question.low for question in checked)


@pytest.mark.parametrize(
    ("key", "text", "said"),
    [
        ("com_height", "75.9", "com_height is 75.9 m; expected 0.004 to 0.85 m .* Is it in mm. Then write `75.9 mm`"),
        ("swing_period", "0.31", "Was it the time of half a swing"),
        ("body_inertia_yaw", "0.2 kg·m²", "expected at most 0.121 kg·m², as a body of 1.09 kg"),
        ("body_inertia_yaw", "8e-3", "body_inertia_yaw of robot 'mine' is 0.008 kg·m², more than"),
        ("robot_mass", "0.05", "body_mass must be more than 0 kg; found -0.02"),
        ("wheel_width", "26 kg", "has the unit 'kg'"),
        ("wheel_radius", "twelve", "is no number.* Or compute it: ten_turns"),
        ("colour", "red", "no question 'colour'. The questions are: control_period"),
    ],
)
def test_an_answer_that_cannot_be_is_refused_with_a_sentence(key, text, said):
    with pytest.raises(ConfigError, match=said):
        Interview("mine", {**ANSWERS, key: text}, nobody()).run()


def test_what_is_missing_is_named_all_at_once():
    texts = {key: text for key, text in ANSWERS.items() if key not in ("track", "stall_torque", "wheel_width")}
    with pytest.raises(ConfigError, match=r"lacks wheel_width, track, stall_torque\. Run this in a terminal"):
        Interview("mine", texts, nobody()).run()


def test_a_number_with_its_unit_is_taken_however_odd():
    assert answered(QUESTIONS["com_height"], "5 m", {}).value == 5.0


def test_a_wrong_answer_is_asked_again_and_enter_takes_what_is_offered():
    lines = [*("10", "100 Hz"), *("?", "35 g"), "1.09 kg", "34 mm", "0.026", "0.25", "0.0759"]
    lines += ["", "", "3.77e-3", "6.62e-3", "box", "0.1", "0.2", "stall", "0.49"]
    script = Scripted(*lines)
    found = Interview("mine", {}, script.person()).run()
    assert not script.lines
    assert found["control_period"].value == 0.01
    assert any("Is it in ms?" in line for line in script.shown)
    assert any("Weigh both wheels together" in line for line in script.shown)
    assert found["com_offset"][:2] == (0.0, "guess")
    assert any("(Enter: disk, 2.023e-05 kg·m²)" in line for line in script.shown)
    assert found["wheel_inertia"].value == pytest.approx(0.035 * 0.034**2 / 2)
    assert found["torque_limit"].value == 0.98


SMALL = {"wheel_mass": 0.03, "body_mass": 1.04, "wheel_radius": 0.033}  # 1.1 kg on wheels of 33 mm: m g r = 0.36 N·m


@pytest.mark.parametrize(("key", "lifting"), [("torque_limit", 0.356), ("stall_torque", 0.178)])
def test_a_torque_in_kg_cm_without_its_unit_is_asked_again_where_the_robot_is_known(key, lifting):
    assert answered(QUESTIONS[key], "8.5", {}).value == 8.5
    with pytest.raises(
        ConfigError, match=r"Is it in kg·cm\? Then write `8\.5 kg cm`\. If it is right, write `8\.5 N m`"
    ):
        answered(QUESTIONS[key], "8.5", SMALL)
    assert answered(QUESTIONS[key], "8.5 kg cm", SMALL).value == pytest.approx(8.5 * 9.80665e-2)
    assert answered(QUESTIONS[key], "8.5 N m", SMALL).value == 8.5
    assert answered(QUESTIONS[key], f"{10 * lifting:.3g}", SMALL).value == pytest.approx(10 * lifting, rel=0.01)


def test_a_torque_that_is_computed_of_wrong_units_is_asked_again_with_what_it_was_computed_of():
    motor = {"motor_voltage": 12.0, "motor_resistance": 7.0, "motor_constant": 0.98, "motor_gear": 30.0}
    with pytest.raises(
        ConfigError, match=r"torque_limit comes to 100.8 N·m by motor; .* motor_constant, motor_gear right"
    ):
        answered(QUESTIONS["torque_limit"], "motor", SMALL | motor)
    right = SMALL | motor | {"motor_constant": 0.0098}
    assert answered(QUESTIONS["torque_limit"], "motor", right).value == pytest.approx(1.008)


def test_an_inertia_that_only_a_lump_has_is_refused_before_others_are_held_against_it():
    with pytest.raises(ConfigError, match=r"body_inertia_pitch is 1e-05 kg·m²; expected 2\.6e-05 to 30 kg·m²"):
        answered(QUESTIONS["body_inertia_pitch"], "0.00001", SMALL)


def test_oz_in_is_understood_however_it_is_written():
    for text in ("100 oz-in", "100 oz·in", "100 oz in"):
        assert answered(QUESTIONS["stall_torque"], text, {}).value == pytest.approx(100 * 0.0283495 * 9.80665 * 0.0254)


def test_each_value_of_the_sheet_says_where_it_comes_from_beside_it():
    lines = sheet_text("mine", Interview("mine", ANSWERS, nobody()).run()).splitlines()
    comments = {line.partition(":")[0]: line.partition("#")[2] for line in lines}
    assert all(comments[key].partition("; ")[2] for key in SHEET)
    assert comments["track"] == " m; measured"


def test_an_earlier_answer_is_changed_by_its_name_and_what_rests_on_it_is_computed_anew():
    lines = ["100 Hz", "35 g", "1.09", "34 mm", "26 mm", "0.25", "7.59 cm", "", "disk", "5e-5", "6.62e-3"]
    yaw = ["back", "6.62e-3", "4.4e-3", "body_inertia_pitch", "3.77e-3", "wheel_mass", "40 g", "8e-3", "0.98"]
    script = Scripted(*lines, *yaw)
    found = Interview("mine", {}, script.person()).run()
    assert not script.lines
    assert found["wheel_mass"].value == 0.04
    assert found["wheel_inertia"].value == pytest.approx(0.04 * 0.034**2 / 2)
    assert found["body_inertia_yaw"].value == 0.008
    assert found["body_inertia_pitch"].value == 3.77e-3
    assert any(
        "To change an earlier answer, type its name, as control_period, or back." in line for line in script.shown
    )
    assert script.kept["wheel_mass"] == "40 g"


def test_back_leaves_a_way_and_says_so_where_nothing_is_before():
    script = Scripted("back", "track", "", "100 Hz", "35 g", "less_wheels", "back", "1.09 kg")
    with pytest.raises(KeyboardInterrupt):
        Interview("mine", {}, script.person()).run()
    assert script.kept["body_mass"] == "1.09 kg"
    told = [line for line in script.shown if not line.endswith("? ")]
    assert told[:2] == ["There is no question before this one.", "track has no answer yet."]
    assert told[2].startswith("Expected is time for which each command is held")


def test_ctrl_c_at_any_question_loses_no_answer():
    lines = ["100 Hz", "35 g", "less_wheels", "1.16", "ten_turns", "2.136", "26 mm", "0.25", "7.59 cm", "", "disk"]
    lines += ["swing", "0.62", "box", "0.2", "0.15", "box", "0.08", "stall", "5 kg·cm"]
    whole = Interview("mine", {}, Scripted(*lines).person()).run()
    for count in range(len(lines)):
        first = Scripted(*lines[:count])
        with pytest.raises(KeyboardInterrupt):
            Interview("mine", {}, first.person()).run()
        second = Scripted(*lines[count:])
        assert Interview("mine", first.kept, second.person()).run() == whole
        assert not second.lines


def test_questions_have_the_units_of_the_settings_and_every_value_is_asked():
    units = {row.key.removeprefix("robot."): row.kind.unit for row in ROBOT}
    assert {question.key for question in VALUES} == set(SHEET)
    assert all(question.unit == units[question.key] for question in VALUES)
    assert all(key in QUESTIONS for question in VALUES for way in question.ways for key in way.needs)


@pytest.mark.parametrize("value", [3e-5, 2.02246e-5, 1.0, 0.01, 123456.0, 1e-9])
def test_numbers_are_numbers_to_a_plain_reader_of_yaml(value):
    assert yaml.safe_load(f"a: {number(value)}")["a"] == pytest.approx(value)


@pytest.mark.parametrize("value", [0.7, 0.8, 1.0000055, 20.0, 3.1234567, 0.01, 123456.7, 3e-5])
def test_a_limit_is_written_as_no_more_than_single_precision_tells(value):
    single = float(np.float32(value))
    found = written_at_most(single)
    assert found <= single * (1 + 1e-7)
    assert found >= single * (1 - 1.1e-5)
    assert float(number(found)) == found
    assert (found == value) == (float(f"{value:.6g}") == value)


@pytest.mark.parametrize("name", ["", "my robot", "../x", "1st", "a" * 65, "é", "a.b"])
def test_a_name_that_is_no_file_name_is_refused(name):
    with pytest.raises(ConfigError, match="cannot be called"):
        check_name(name)


@pytest.mark.parametrize(
    ("key", "text", "unit"),
    [
        ("body_inertia_pitch", "60000", "g cm²"),  # 7 cm of gyration beside a centre of mass at 9 cm
        ("body_inertia_pitch", "6000", "kg mm²"),  # the same; in g cm² it would be 2 cm
        ("body_inertia_pitch", "6000000", "g mm²"),
        ("body_inertia_roll", "70000", "g cm²"),
    ],
)
def test_an_inertia_without_a_unit_is_offered_the_one_in_which_it_belongs_to_the_body(key, text, unit):
    known = {"body_mass": 1.09, "com_height": 0.09, "wheel_mass": 0.04, "wheel_radius": 0.04}
    known |= {} if key == "body_inertia_pitch" else {"body_inertia_pitch": 6e-3}
    with pytest.raises(ConfigError, match=f"Then write `{text} {unit}`"):
        answered(QUESTIONS[key], text, known)


def test_the_question_for_the_wheel_says_which_number_is_on_the_package():
    assert "radius of the wheels, half the diameter on the package" in QUESTIONS["wheel_radius"].what
