"""Robots of another generator that twbal got wrong: a tilt filter hid a delay, and poles of motors hid all else."""

import json

import pytest

from benchmarks.other_robots.__main__ import sheet_of
from benchmarks.other_robots.recording import record
from benchmarks.other_robots.sets import sets
from twbal.cli.main import main


def diagnosed(stratum, seed, folder):
    """What is hidden in a robot, and its diagnosis."""
    (each,) = sets([stratum], [seed])
    label = record(each, sheet_of(each), folder / "log")
    words = [f"episodes={folder / 'log'}", f"robot={each.sheet}", f"robot.control_period={1.0 / each.rate}"]
    words += [f"diagnosis.tolerances.data_sheet={each.tolerance}", f"hydra.run.dir={folder / 'out'}"]
    assert main(["diagnose", *words]) == 0
    return label["hidden"], json.loads((folder / "out" / "diagnosis.json").read_text())


@pytest.mark.slow
def test_a_late_torque_is_found_beside_a_filter_that_sums_up_the_gyro(tmp_path):
    hidden, found = diagnosed("single 1/8", 1428, tmp_path)
    assert found["verdict"] == "named"
    named = {effect["name"]: effect for effect in found["effects"] if effect["is_named"]}
    (late,) = set(named) - {"tilt_filter"}
    assert "actuation_delay" in {late, *named[late]["equivalents"]}
    (size,) = named[late]["parameters"].values()
    assert size["value"] == pytest.approx(hidden["actuation_delay"]["delay"], rel=0.1)


@pytest.mark.slow
def test_poles_of_a_robot_that_turns_hide_nothing_else(tmp_path):
    hidden, found = diagnosed("pairs", 1431, tmp_path)
    likely = {effect["name"]: effect for effect in found["effects"] if effect["probability"] >= 0.9}
    assert {"cogging", "battery_sag", "tilt_filter"} <= set(likely)
    sizes = likely["cogging"]["parameters"]
    assert sizes["count"]["value"] == pytest.approx(hidden["cogging"]["count"], abs=0.1)
    assert sizes["torque"]["value"] == pytest.approx(hidden["cogging"]["torque"], rel=0.15)
