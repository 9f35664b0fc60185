"""What speaks against arming a robot: its last check, and every change since."""

import json
from dataclasses import replace

import pytest

from twbal.cli.settings.robot_settings import ROBOT
from twbal.core.errors import DataError
from twbal.core.robot_parameters import parameter_hash
from twbal.core.robot_sheet import VALUES
from twbal.sheets.link_record import (
    Announced,
    LinkRecord,
    keep_record,
    last_record,
    objection,
    records_folder,
    sheet_numbers,
)

UNITS = {row.key.removeprefix("robot."): row.kind.unit for row in ROBOT}
ME = Announced("balancer", 2, 7, 0.01, 0.98)


def record(robot, **changed):
    return replace(LinkRecord(robot.name, parameter_hash(robot), ME, "2026-01-01 10:00:00", (), ()), **changed)


def test_a_robot_that_is_as_it_was_may_be_armed(paper, tmp_path):
    keep_record(record(paper), tmp_path)
    assert objection(last_record(tmp_path, "paper", "balancer"), paper, ME) == ""


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("robot", "other", "its robot was 'balancer' and is 'other'"),
        ("version", 1, "its version was 2 and is 1"),
        ("firmware", 8, "its firmware was 00000007 and is 00000008"),
        ("firmware", 0, "its firmware was 00000007 and is not numbered"),
        ("control_period", 0.02, "its control period was 0.01 s and is 0.02 s"),
        ("torque_limit", 0.8999999761581421, "its torque limit was 0.98 N·m and is 0.9 N·m"),
        ("torque_limit", 0.98000001, "its torque limit was 0.98 N·m and is 0.98000001 N·m"),
    ],
)
def test_whatever_else_the_robot_says_of_itself_is_named(field, value, said, paper, tmp_path):
    keep_record(record(paper), tmp_path)
    now = ME._replace(**{field: value})
    assert said in objection(last_record(tmp_path, "paper", now.robot), paper, now)


def test_problems_and_each_changed_value_of_the_sheet_are_named(paper):
    assert "found something wrong: stop, watchdog." in objection(
        record(paper, problems=("stop", "watchdog")), paper, ME
    )
    for name in ("body_mass", "com_offset", "track"):
        heavier = replace(paper, **{name: getattr(paper, name) + 1e-3})
        assert "values of the sheet 'paper' have changed" in objection(record(paper), heavier, ME)
        kept = record(paper, values=sheet_numbers(paper))
        before, now = getattr(paper, name), getattr(heavier, name)
        named = f": {name} was {before:g} {UNITS[name]} and is {now:g} {UNITS[name]}."
        assert objection(kept, heavier, ME).endswith(named)
        assert objection(kept, paper, ME) == ""


def test_checks_that_were_left_out_speak_against_the_robot_where_they_are_needed(paper, tmp_path):
    keep_record(record(paper, skipped=("signs by hand", "difference sign")), tmp_path)
    kept = last_record(tmp_path, "paper", "balancer")
    assert objection(kept, paper, ME) == objection(kept, paper, ME, ("watchdog",)) == ""
    said = objection(kept, paper, ME, ("watchdog", "signs by hand"))
    assert said == "the last twbal check-link of 2026-01-01 10:00:00 left out: signs by hand."


def test_a_check_that_did_not_finish_speaks_against_the_robot(paper, tmp_path):
    keep_record(record(paper, finished=False), tmp_path)
    said = objection(last_record(tmp_path, "paper", "balancer"), paper, ME)
    assert said == "the last twbal check-link of 2026-01-01 10:00:00 did not finish."


def test_a_record_of_an_older_version_is_read_and_names_no_value(paper, tmp_path):
    path = keep_record(record(paper, values=sheet_numbers(paper)), tmp_path)
    tree = json.loads(path.read_text())
    assert set(tree.pop("values")) == set(VALUES)
    assert (tree.pop("finished"), tree.pop("skipped")) == (True, [])
    path.write_text(json.dumps(tree))
    old = last_record(tmp_path, "paper", "balancer")
    assert objection(old, paper, ME) == ""
    assert objection(old, replace(paper, track=0.5), ME).endswith(
        "have changed since the last twbal check-link of 2026-01-01 10:00:00."
    )


def test_another_sheet_for_a_checked_robot_is_a_change_and_a_strange_robot_with_another_sheet_is_unknown(
    paper, regbot, tmp_path
):
    keep_record(record(paper), tmp_path)
    assert "was with the sheet 'paper', and this is 'regbot'" in objection(
        last_record(tmp_path, "regbot", "balancer"), regbot, ME
    )
    assert last_record(tmp_path, "regbot", "stranger") is None
    assert last_record(tmp_path / "none", "paper", "balancer") is None


def test_of_two_robots_each_has_its_own_record(paper, regbot, tmp_path):
    keep_record(record(paper, problems=("stop",)), tmp_path)
    keep_record(record(regbot, checked="2026-01-02 10:00:00"), tmp_path)
    assert last_record(tmp_path, "paper", "balancer").problems == ("stop",)
    assert last_record(tmp_path, "regbot", "balancer").problems == ()
    assert last_record(tmp_path, "third", "balancer").sheet == "regbot"


def test_a_damaged_record_is_an_error_and_not_a_robot_that_was_never_checked(paper, tmp_path):
    keep_record(record(paper), tmp_path).write_text("{")
    with pytest.raises(DataError, match="is not JSON"):
        last_record(tmp_path, "paper", "balancer")


def test_names_that_are_no_file_names_stay_within_the_folder(paper, tmp_path):
    path = keep_record(record(paper, announced=ME._replace(robot="../../é x")), tmp_path)
    assert path.parent == tmp_path
    assert last_record(tmp_path, "paper", "../../é x") is not None


def test_records_lie_in_the_state_folder_of_the_user(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert records_folder() == tmp_path / "twbal" / "links"
