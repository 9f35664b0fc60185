"""Import checks on a few robots of MuJoCo: silence on right logs, a sentence for each fault; and the tables."""

import pytest

from benchmarks.import_checks.case import convention, correct, planted
from benchmarks.import_checks.other_sensors import CONVENTIONS
from benchmarks.import_tables import import_checks, import_misses

RIGHT = (11, 12, 18)
"""A ride by remote, noise on the command, and pushes, of robots that thresholds were fixed on."""

FAULTS = {
    "sign": 4,
    "unit": 11,
    "shifted row": 2,  # a log with tilt_rate, without which the row of commands is not told
    "swapped wheels": 4,
    "wrong rate": 12,
    "duplicate": 2,
    "wrong column": 11,
    "jump": 12,
}


@pytest.mark.parametrize("seed", RIGHT)
def test_nothing_is_said_of_a_log_that_is_right(seed):
    assert correct(seed)["said"] == []


@pytest.mark.parametrize("name", CONVENTIONS)
@pytest.mark.parametrize("seed", [1, 5])
def test_bunched_stamps_and_a_tilt_that_is_worked_out_are_no_fault_and_come_out_right(seed, name):
    case = convention(seed, name)
    assert case["said"] == [] and case["off"] <= 1.0


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_named(fault):
    case = planted(FAULTS[fault], fault)
    assert case["named"], case


def test_saturated_commands_make_no_false_warning_and_that_is_said():
    """A bang-bang limit cycle, of which the checks once said that its commands stand a row too early."""
    log = correct(2010)
    assert log["said"] == [] and any("which row the commands belong to" in sentence for sentence in log["untold"])


def test_tables_list_what_was_not_named():
    case = {
        "seed": 7,
        "fault": "sign",
        "what": "sign of tilt",
        "found": True,
        "named": False,
        "said": ["row: tilt is late: why?"],
        "untold": [],
    }
    quiet = {"seed": 1, "said": []}
    loud = {"seed": 2, "said": ["time: time runs slow: is it?"]}
    missed = {**case, "found": False, "said": [], "untold": ["which row"]}
    again = [{"what": "cut", "said": ["rows in common"]}, {"what": "cut", "said": []}]
    of_bunches = {"seed": 3, "convention": "bunches", "off": 0.2, "said": []}
    conventions = [of_bunches, {**of_bunches, "off": 2.5}, {**of_bunches, "off": None, "said": loud["said"]}]
    conventions += [{**of_bunches, "convention": "no tilt", "off": off} for off in (0.3, 1.0, 1.02)]
    faults = [case, missed, {**case, "named": True}]
    results = {"logs": [quiet, loud], "conventions": conventions, "faults": faults, "again": again}
    assert import_checks(results)[2:] == [
        "| right ones | 2 | | 1 | | |",
        "| right ones, bunches | 3 | 1/3 | 1 | | |",
        "| right ones, no tilt | 3 | 2/3 | 0 | | |",
        "| sign | 3 | | 2 | 1 | 1 |",
        "| a second call: cut | 2 | | 1 | | |",
    ]
    assert import_misses(results) == [
        '- robot 2, nothing wrong: "time runs slow".',
        "- robot 3, bunches: 2.5 times as far off as is right.",
        '- robot 3, bunches: "time runs slow".',
        "- robot 3, no tilt: the tilt is off by 0.0204 rad (standard deviation); at most 0.02 is right.",
        '- robot 7, sign of tilt: taken for another: "tilt is late".',
        "- robot 7, sign of tilt: the log does not tell, as is said, which row.",
    ]
    results |= {"conventions": [], "faults": [{**missed, "untold": []}]}
    assert import_misses(results)[1:] == ["- robot 7, sign of tilt: missed."]
