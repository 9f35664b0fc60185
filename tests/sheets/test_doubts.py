"""Which values of a whole sheet are doubted."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf

from twbal.sheets.doubts import doubts

ROOT = Path(__file__).parents[2]
SHEETS = sorted([*ROOT.glob("conf/robot/*.yaml"), *ROOT.glob("data/*/robot/*.yaml")])


@pytest.fixture(scope="module")
def small():
    """Wheels of 34 mm and a body of 1.09 kg."""
    return instantiate(OmegaConf.load(ROOT / "conf/robot/esp32.yaml"))


@pytest.mark.parametrize("file", SHEETS, ids=lambda file: file.stem)
def test_sheets_of_robots_that_there_are_are_believed(file):
    assert doubts(instantiate(OmegaConf.load(file))) == []


@pytest.mark.parametrize(
    ("key", "value", "slip"),
    [
        ("com_height", 7.0, r"expected 0\.004 to 0\.176 m .* Is it in cm\?"),
        ("com_height", 0.7, r"expected 0\.004 to 0\.176 m .*radius of gyration.* Is its decimal point right\?"),
        ("body_mass", 900.0, r"expected 0\.05 to 50 kg .* Is it in g\?"),
        ("torque_limit", 600.0, r"expected 0\.01 to 6\.19 N·m .* Is it in mN·m\?"),
        ("track", 250.0, r"is 250 m; expected .* Is it in mm\?"),
        ("wheel_radius", 34.0, r"is 34 m; expected .* Is it in mm\?"),
        ("wheel_mass", 35.0, r"is 35 kg; expected .* Is it in g\?"),
        ("control_period", 10.0, r"is 10 s; expected .* Is it in ms\?"),
        ("com_offset", 1.2, r"is 1\.2 rad; expected .* Is it in deg\?"),
    ],
)
def test_a_slip_of_one_value_is_one_doubt_with_the_unit_that_may_be_meant(small, key, value, slip):
    (said,) = doubts(replace(small, **{key: value}))
    assert said.startswith(f"{key} of robot 'esp32' is {value:g} ")
    assert re.search(slip, said), said


def test_several_slips_are_told_one_by_one(small):
    said = doubts(replace(small, body_mass=900.0, com_height=7.0))
    assert [line.split()[0] for line in said] == ["body_mass", "com_height"]


@pytest.mark.parametrize(("lever", "is_doubted"), [(2.9, False), (3.1, True)])
def test_a_body_that_is_a_lump_far_above_its_axle_is_doubted(lever, is_doubted, small):
    """Of a height of the centre of mass of three times the radius of gyration √(I/m) on."""
    inertia = small.body_mass * (small.com_height / lever) ** 2
    compact = {f"body_inertia_{axis}": inertia for axis in ("pitch", "roll", "yaw")}
    said = doubts(replace(small, **compact))
    assert len(said) == is_doubted
    assert all("radius of gyration" in line and "body_inertia_pitch" in line for line in said)
