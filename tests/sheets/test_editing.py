"""Values of sheets that people wrote: the numbers change, and nothing else does."""

from pathlib import Path

import pytest
import yaml

from twbal.core.errors import ConfigError
from twbal.core.robot_sheet import ValueProvenance, provenance_of
from twbal.sheets.editing import SheetEdit, edited, noted, renamed

SHEETS = sorted((Path(__file__).resolve().parents[2] / "conf" / "robot").glob("*.yaml"))
BLOCKS = """\
# Mine.
_target_: twbal.core.robot_sheet.robot_sheet
name: "mine"
control_period: 0.02   # s; loop
torque_limit: 1.0
provenance:
  # from the shop
  data_sheet:
    - torque_limit   # of the box
    - track
  guess:
    - control_period
"""


def comments(text):
    """Words of all comments, but for the numbers of lines."""
    return {word.rstrip(";:") for line in text.splitlines() for word in line.partition("#")[2].split()}


@pytest.mark.parametrize("sheet", SHEETS, ids=lambda sheet: sheet.stem)
@pytest.mark.parametrize("kind", ValueProvenance)
@pytest.mark.parametrize("key", ["control_period", "torque_limit", "com_offset", "wheel_inertia"])
def test_one_value_of_a_packaged_sheet_changes_with_its_provenance_and_no_comment_is_lost(sheet, kind, key):
    text = sheet.read_text()
    new = edited(text, [SheetEdit(key, 3e-05, kind, "as said")])
    before, after = yaml.safe_load(text), yaml.safe_load(new)
    assert after[key] == 3e-5
    kinds = provenance_of("it", before.pop("provenance")) | {key: kind}
    assert provenance_of("it", after.pop("provenance")) == kinds
    assert {**before, key: 3e-5} == after
    assert comments(text) <= comments(new)
    assert "as said; before: " in new


def test_lists_of_lines_and_quotes_are_understood():
    changes = [
        SheetEdit("control_period", 0.01, ValueProvenance.MEASURED, "timed"),
        SheetEdit("torque_limit", 0.5, ValueProvenance.GUESS, "new"),
    ]
    new = edited(BLOCKS, changes)
    assert yaml.safe_load(new)["provenance"] == {
        **{"measured": ["control_period"], "data_sheet": ["track"], "guess": ["torque_limit"]}
    }
    assert "control_period: 0.01   # s; timed; before: 0.02, guess: loop" in new
    assert "torque_limit: 0.5  # new; before: 1.0, data_sheet" in new
    assert "# from the shop" in new


def test_a_remark_of_a_change_takes_the_place_of_that_of_an_earlier_one():
    once = edited(BLOCKS, [SheetEdit("control_period", 0.01, ValueProvenance.MEASURED, "timed, monday")])
    twice = edited(once, [SheetEdit("control_period", 0.005, ValueProvenance.MEASURED, "timed, tuesday")])
    assert "control_period: 0.005   # s; timed, tuesday; before: 0.01, measured: loop" in twice
    grown = once.replace("# s; ", "# s; timed, sunday; before: 0.03, guess: ")
    again = edited(grown, [SheetEdit("control_period", 0.005, ValueProvenance.MEASURED, "timed, tuesday")])
    assert again.splitlines()[3] == twice.splitlines()[3]


def test_no_change_is_the_same_text_and_a_name_changes_alone():
    assert edited(BLOCKS, []) == BLOCKS
    assert renamed(BLOCKS, "yours") == BLOCKS.replace('"mine"', "yours")


def test_notes_take_the_place_of_earlier_ones():
    once = noted(BLOCKS, "monday", ["a 1", "b 2"])
    assert once == f"{BLOCKS}# twbal check-link, monday:\n#   a 1\n#   b 2\n"
    assert noted(once, "tuesday", ["c 3"]) == noted(BLOCKS, "tuesday", ["c 3"])
    assert noted(BLOCKS.rstrip("\n"), "monday", []) == f"{BLOCKS}# twbal check-link, monday:\n"


@pytest.mark.parametrize("text", ["", "a: [", "name: x\n", "- a\n", "provenance: {}\n"])
def test_what_is_no_sheet_is_refused(text):
    with pytest.raises(ConfigError, match=r"The sheet is no yaml|no sheet of a robot"):
        edited(text, [])
