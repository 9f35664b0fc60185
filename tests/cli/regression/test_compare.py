"""What moved, by how much it may, and how that is reported."""

from xml.etree import ElementTree

import pytest

from twbal.cli.regression.baseline import Tolerance, compare, junit, table, updated
from twbal.core.errors import ConfigError

TOLERANCES = [Tolerance("*", 0.0, 1e-9), Tolerance("fit/*", 0.1, 0.0)]
BEFORE = {"fit/error": 1.0, "logs/samples": 10.0, "diagnosis/verdict": "named", "logs/gone": 1.0}
NOW = {"fit/error": 1.05, "logs/samples": 11.0, "diagnosis/verdict": "none", "logs/fresh": 1.0}


def test_each_measure_has_the_last_tolerance_that_fits_its_name():
    found = {each.name: each.moved for each in compare(BEFORE, NOW, TOLERANCES)}
    assert found == {
        "fit/error": False,
        "logs/samples": True,
        "diagnosis/verdict": True,
        "logs/gone": True,
        "logs/fresh": True,
    }


@pytest.mark.parametrize("value", [float("nan"), 1.2, 0.8])
def test_what_is_not_within_its_tolerance_has_moved(value):
    (found,) = compare({"fit/error": 1.0}, {"fit/error": value}, TOLERANCES)
    assert found.moved


def test_the_table_names_what_moved_and_counts_the_rest():
    said = table(compare(BEFORE, NOW, TOLERANCES))
    assert "10 -> 11" in said
    assert "'named' -> 'none'" in said
    assert "not in the baseline" in said
    assert "gone" in said
    assert "fit        1 of 1 as in the baseline" in said
    assert "fit/error" not in said


def test_junit_has_a_case_for_each_measure():
    whole = ElementTree.fromstring(junit(compare(BEFORE, NOW, TOLERANCES)))
    counts = {suite.get("name"): (suite.get("tests"), suite.get("failures")) for suite in whole}
    assert counts == {"fit": ("1", "0"), "logs": ("3", "3"), "diagnosis": ("1", "1")}
    failed = [case.get("name") for case in whole.iter("testcase") if case.find("failure") is not None]
    assert sorted(failed) == ["fresh", "gone", "samples", "verdict"]
    assert {case.get("classname") for case in whole.iter("testcase")} == {
        f"twbal.regress.{part}" for part in ("fit", "logs", "diagnosis")
    }


def test_an_update_keeps_the_digits_of_what_did_not_move():
    assert updated(compare(BEFORE, NOW, TOLERANCES)) == {**NOW, "fit/error": BEFORE["fit/error"]}


def test_a_measure_without_a_tolerance_is_an_error():
    with pytest.raises(ConfigError, match="No tolerance fits the measure 'logs/samples'"):
        compare({"logs/samples": 1.0}, {"logs/samples": 1.0}, [Tolerance("fit/*", 0.1, 0.0)])
    for wrong in (-0.1, float("nan"), float("inf")):
        with pytest.raises(ConfigError, match="must be finite and not negative"):
            Tolerance("*", wrong, 0.0)
