"""What counts as named, found, false and right, and the figures that are made of it."""

import numpy as np
import pytest

from benchmarks.other_robots.findings import findings, probabilities
from benchmarks.other_robots.robots import ITEMS
from benchmarks.other_robots.score import judged
from benchmarks.other_robots.tables import (
    PARTS,
    brier_score,
    calibration_error,
    clopper_pearson,
    figures,
    log_score,
    other_robots_sensors,
    share,
)
from benchmarks.other_robots.versions import other_robots_unseen, other_robots_versions


def label(hidden, stratum="single 1", left_out=(), tilt_constant=0.0, on_shaft=0.0):
    facts = {"seed": 0, "excitation": "E", "rate": 50, "sheet": "paper", "tolerance": 0.03, "sensors": "ideal"}
    facts |= {"gentler": 1.0, "stays_up": True, "sensor_values": {"tilt_constant": tilt_constant, "on_shaft": on_shaft}}
    return {**facts, "stratum": stratum, "effects": dict.fromkeys(hidden, 1.0), "hidden": hidden, "left_out": left_out}


def finding(name, probability=0.95, equivalents=(), **parameters):
    return {"name": name, "probability": probability, "equivalents": list(equivalents), "parameters": parameters}


def said(*effects, beyond=False, verdict="named"):
    remaining = {"share": 0.1, "is_beyond_noise": beyond}
    return {"schema": 2, "verdict": verdict, "effects": list(effects), "remaining": remaining}


DEAD_ZONE = {"dead_zone": {"width": 1.0, "own_skew": 0.0}}


def test_a_finding_under_its_own_name_is_found_and_its_interval_is_held_against_the_truth():
    width = {"value": 1.1, "low95": 0.9, "high95": 1.2}
    row = judged(label(DEAD_ZONE), said(finding("dead_zone", 0.7, width=width)), 3.0)
    assert row["hidden"] == {"dead_zone": 0.7} and row["said"][0]["right"] and not row["remains"]
    assert row["intervals"] == [["dead_zone", "width", 1.0, 1.1, 0.9, 1.2, True]]


STRIBECK = {"stribeck_friction": {"torque": 0.2, "breakaway": 0.3, "rate": 2.0}}


@pytest.mark.parametrize(
    ("hidden", "effect", "right", "substitute"),
    [
        ({"com_offset": {"angle": 0.03}}, finding("imu_mount_angle"), True, False),
        ({"torque_gain": {"gain": 0.8}}, finding("body_mass"), True, False),
        (DEAD_ZONE, finding("coulomb_friction", equivalents=["dead_zone"]), False, True),
        (STRIBECK, finding("coulomb_friction"), False, True),
        (DEAD_ZONE, finding("motor_lag"), False, False),
    ],
)
def test_only_declared_equivalents_are_right_and_those_of_a_report_or_cases_are_neither(
    hidden, effect, right, substitute
):
    row = judged(label(hidden), said(effect), 3.0)
    (found,) = findings(row)
    assert (found.is_right, found.is_substitute, found.is_false) == (right, substitute, not right and not substitute)
    assert row["hidden"] == probabilities(row) == {name: 0.95 if right else 0.0 for name in hidden}


def test_of_older_records_what_was_found_by_a_substitute_is_not_found():
    row = judged(label(DEAD_ZONE), said(finding("coulomb_friction", 0.9, ["dead_zone"])), 3.0)
    assert probabilities({**row, "hidden": {"dead_zone": 0.9}}) == {"dead_zone": 0.0}


def test_a_class_of_the_data_sheet_counts_as_its_values_in_records_too():
    record = {"verdict": "data_sheet", "effects": [], "data_sheet_class": ["gain, mass and inertia"]}
    assert probabilities(judged(label({"torque_gain": {"gain": 0.8}}), record, 1)) == {"torque_gain": 1.0}


def test_a_refused_recording_is_not_found_and_counts_neither_as_free_of_errors_nor_in_the_time():
    rows = [judged(label(DEAD_ZONE), said(finding("dead_zone")), 2.0), judged(label(DEAD_ZONE), None, 90.0)]
    single = PARTS["other_robots"]({"sets": rows})[-1]
    assert single == "| single 1 | 2 | 1 of 2 (1-99 %) | 1 of 2 (1-99 %) | 0.00 | 0 of 1 (0-98 %) | 0 of 1 (0-98 %) |"
    found = figures(rows)
    assert found["CPU seconds of the command, median / 90th percentile"] == "2.0 / 2.0"
    assert found["no diagnosis"] == "1" and found["hidden effects given less than 0.02"] == "0 of 1"


def test_hidden_effects_of_which_nothing_is_said_are_in_the_scores_as_probability_0():
    both = {**DEAD_ZONE, "motor_lag": {"time_constant": 0.02}}
    found = figures([judged(label(both, "pairs"), said(finding("dead_zone", 0.9)), 2.0)])
    assert found["hidden effects given less than 0.02"] == "1 of 2"
    brier = "Brier score, and of base rates"
    assert found[brier] == "0.010, 0.000"
    assert found[f"{brier}, hidden effects given less than 0.02 included"] == "0.505, 0.000"


def test_figures_stand_with_effects_that_are_easy_and_without_them():
    row = judged(label({}, "clean", (), 0.7) | {"sensors": "real"}, said(finding("tilt_filter"), finding("cogging")), 1)
    found = figures([row])
    assert found["effects with P of at least 0.9 that are right"] == "1 of 2 (1-99 %)"
    assert found["the same without presliding and tilt filters"] == "0 of 1 (0-98 %)"


def test_figures_stand_without_robots_that_another_benchmark_had_used():
    rows = [judged(label(DEAD_ZONE, stratum), said(finding("dead_zone")), 2.0) for stratum in ("single 1", "pairs")]
    lines = other_robots_unseen({"sets": rows}, {"sets": [{"stratum": "pairs", "seed": 0}]})
    assert lines[0] == "| figure | all 2 robots | the 1 others |"
    assert "| hidden effects that are found | 2 of 2 (16-100 %) | 1 of 1 (3-100 %) |" in lines


def test_the_severity_is_told_as_it_was_driven():
    row = judged(label(DEAD_ZONE) | {"gentler": 0.5}, said(), 1.0)
    assert (row["severity"], row["driven_severity"]) == ({"dead_zone": 1.0}, {"dead_zone": 0.5})


def test_play_is_behind_the_encoders_where_they_sit_on_the_shafts():
    play = {"backlash": {"gap": 0.05, "own_share": 0.5}}
    gap = {"value": 0.05, "low95": 0.04, "high95": 0.06}
    on_shaft, on_wheel = (
        judged(label(play, on_shaft=shaft), said(finding("backlash_behind_encoder", 0.9, gap=gap)), 3.0)
        for shaft in (1.0, 0.0)
    )
    assert on_shaft["hidden"] == {"backlash_behind_encoder": 0.9} and len(on_shaft["intervals"]) == 1
    assert on_wheel["hidden"] == {"backlash": 0.0} and not on_wheel["intervals"]


def test_another_name_is_false_and_a_case_of_what_is_there_is_neither():
    false = judged(label(DEAD_ZONE), said(finding("motor_lag")), 3.0)
    assert false["hidden"] == {"dead_zone": 0.0} and not false["said"][0]["right"]
    part = judged(label(STRIBECK), said(finding("coulomb_friction")), 3.0)
    assert part["hidden"] == {"stribeck_friction": 0.0} and part["said"][0]["right"]


@pytest.mark.parametrize(("constant", "right"), [(0.7, True), (0.0, False)])
def test_a_tilt_filter_is_there_where_the_tilt_comes_from_one(constant, right):
    """In a period of 20 ms, one of 0.7 s keeps 0.7 / 0.72 of its error: a rate of 1.4085 /s."""
    rate = {"value": 1.5, "low95": 1.4, "high95": 1.6}
    row = judged(label({}, "clean", (), constant), said(finding("tilt_filter", rate=rate)), 3.0)
    assert row["said"] == [{"name": "tilt_filter", "probability": 0.95, "right": right}]
    if right:
        (interval,) = row["intervals"]
        assert interval[2] == pytest.approx(1.4085, abs=1e-4) and interval[-1]
    else:
        assert row["intervals"] == []


def test_what_is_foreign_or_left_out_cannot_be_found_but_can_be_said_to_remain():
    foreign = judged(
        label({"flexible_mast": {"share": 0.1}}, "foreign"), said(finding("rolling_viscous"), beyond=True), 1
    )
    assert foreign["foreign"] == ["flexible_mast"] and foreign["hidden"] == {} and foreign["remains"]
    assert not foreign["said"][0]["right"]
    absent = judged(label(DEAD_ZONE, "left out", ["dead_zone"]), said(verdict="unknown"), 1)
    assert absent["foreign"] == ["dead_zone"] and not absent["remains"]


def test_a_record_without_schema_remains_where_it_is_unknown():
    record = {"verdict": "unknown", "effects": []}
    assert judged(label(DEAD_ZONE), record, 1)["remains"]
    assert judged(label(DEAD_ZONE), None, 1)["verdict"] == "no diagnosis"


def test_a_class_of_the_data_sheet_counts_as_its_values():
    record = {"verdict": "data_sheet", "effects": [], "data_sheet_class": ["gain, mass and inertia"]}
    assert judged(label({"torque_gain": {"gain": 0.8}}), record, 1)["hidden"] == {"torque_gain": 1.0}
    assert judged(label({"wheel_radius": {"factor": 1.1}}), record, 1)["hidden"] == {"wheel_radius": 0.0}
    mass = judged(label({"torque_gain": {"gain": 0.8}}), said(finding("body_mass")), 1)
    assert mass["said"][0]["right"] and mass["hidden"] == {"torque_gain": 0.95}


def test_intervals_of_counts_are_those_of_published_tables():
    assert clopper_pearson(0, 10) == pytest.approx((0.0, 0.3085), abs=1e-4)
    assert clopper_pearson(8, 10) == pytest.approx((0.4439, 0.9748), abs=1e-4)
    assert clopper_pearson(10, 10)[1] == 1.0
    assert share([True, False]) == "1 of 2 (1-99 %)" and share([]) == "-"


def test_scores_of_probabilities_are_right_where_they_can_be_worked_out():
    p, right = np.array([0.9, 0.9, 0.1, 0.1]), np.array([1.0, 1.0, 0.0, 1.0])
    assert brier_score(p, right) == pytest.approx((3 * 0.01 + 0.81) / 4)
    assert log_score(p, right) == pytest.approx(-(3 * np.log(0.9) + np.log(0.1)) / 4)
    assert calibration_error(p, right) == pytest.approx(0.5 * 0.1 + 0.5 * 0.4)


def test_tables_count_what_was_named_found_false_and_wrong():
    rows = [
        judged(label(DEAD_ZONE), said(finding("dead_zone")), 2.0),
        judged(label(DEAD_ZONE), said(finding("dead_zone", 0.6), finding("motor_lag", 0.85)), 4.0),
        judged(label({}, "clean"), said(verdict="none"), 6.0),
    ]
    lines = {part: table({"sets": rows}) for part, table in PARTS.items()}
    single = next(line for line in lines["other_robots"] if line.startswith("| single 1 |"))
    assert single == "| single 1 | 2 | 1 of 2 (1-99 %) | 2 of 2 (16-100 %) | 0.50 | 1 of 2 (1-99 %) | 0 of 2 (0-84 %) |"
    assert "| dead_zone | 2 of 2 | 0 of 0 | 0 |" in lines["other_robots_effects"]
    assert "| motor_lag | 0 of 0 | 0 of 0 | 1 |" in lines["other_robots_effects"]
    assert figures(rows)["CPU seconds of the command, median / 90th percentile"] == "4.0 / 5.6"
    assert len(lines["other_robots_splits"]) == 2 + 5


def test_the_table_of_versions_counts_what_the_library_has_by_how_much_is_hidden():
    both = {**DEAD_ZONE, "motor_lag": {"time_constant": 0.02}}
    rows = [
        judged(label(DEAD_ZONE), said(finding("dead_zone")), 2.0),
        judged(label({}, "clean"), said(finding("cogging", 0.85), beyond=True), 2.0),
        judged(label(both, "pairs"), said(finding("dead_zone", 0.6), finding("motor_lag", 0.3)), 2.0),
        judged(label(DEAD_ZONE, "left out", ["dead_zone"]), said(finding("cogging")), 2.0),
    ]
    *_, line = other_robots_versions({"commit": "0123abcd", "sets": rows})
    cells = [cell.strip() for cell in line.strip("|").split("|")]
    assert cells[:5] == ["0123abcd", "3", "1 of 1", "1 of 1", "0"]
    assert cells[5:] == ["1 of 1", "1 of 2", "-", "-", "-", "1 of 3", "1 of 3", "-"]


def test_the_table_of_sensors_has_a_line_for_each_item_and_counts_by_severity():
    def row(stratum, sensors, hidden, *findings):
        return judged({**label(hidden, stratum), "sensors": sensors}, said(*findings), 1.0)

    rows = [
        row("sensors clean", "jitter", {}, finding("gyro_scale", 0.92)),
        row("sensors clean", "jitter", {}, finding("gyro_scale", 0.85)),
        row("sensors 1", "jitter", DEAD_ZONE, finding("dead_zone")),
        row("sensors 1/4", "real", DEAD_ZONE, finding("dead_zone", 0.6)),
    ]
    lines = {line.split("|")[1].strip(): line for line in other_robots_sensors({"sets": rows})[2:]}
    assert set(lines) == {*ITEMS, "all, `paper`", "all, small sheets", "all"}
    none, one = "0 of 1 (0-98 %)", "1 of 1 (3-100 %)"
    cells = [cell.strip() for cell in lines["jitter"].split("|")[2:-1]]
    assert cells[:6] == ["1 of 2 (1-99 %)", one, one, "-", "-", "2 of 3 (9-99 %)"]
    cells = [cell.strip() for cell in lines["real"].split("|")[2:-1]]
    assert cells[:6] == ["-", "-", "-", none, one, none]
    assert lines["all"].split("|")[2].strip() == "1 of 2 (1-99 %)"


@pytest.mark.parametrize(("hidden", "right"), [({"coulomb_friction": {"torque": 0.1}}, True), (DEAD_ZONE, False)])
def test_dry_friction_of_these_robots_bends_before_it_slides(hidden, right):
    angle = {"value": 0.004, "low95": 0.003, "high95": 0.005}
    row = judged(label(hidden), said(finding("presliding", angle=angle)), 3.0)
    assert row["said"] == [{"name": "presliding", "probability": 0.95, "right": right}]
    assert not row["intervals"]
