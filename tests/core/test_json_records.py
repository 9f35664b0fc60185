"""Records read back as they were written, and what is no such record is refused by the place where it differs."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import pytest

from twbal.core.errors import DataError
from twbal.core.json_records import decoded, encoded, read_record, write_record


class Drive(StrEnum):
    BELT = "belt"
    GEARS = "gears"


class Range(NamedTuple):
    low: float
    high: float = 1.0


@dataclass(frozen=True)
class Wheel:
    radius: float
    drive: Drive
    turns: int | None = None


@dataclass(frozen=True)
class Robot:
    name: str
    wheels: tuple[Wheel, ...]
    ranges: Mapping[str, Range]
    notes: Mapping[str, float | str]
    virtual: bool


ROBOT = Robot(
    name="Höhe <b>",
    wheels=(Wheel(0.03, Drive.GEARS, 7), Wheel(0.04, Drive.BELT)),
    ranges={"tilt": Range(-0.5, 0.5)},
    notes={"mass": 0.3, "colour": "red"},
    virtual=True,
)


def test_a_record_reads_back_as_it_was_written(tmp_path):
    write_record(tmp_path / "robot.json", ROBOT)
    assert read_record(Robot, tmp_path / "robot.json") == ROBOT


def test_json_names_every_field_and_nests_records():
    assert json.loads(json.dumps(encoded(ROBOT)))["wheels"][0] == {"radius": 0.03, "drive": "gears", "turns": 7}
    assert encoded(ROBOT)["ranges"] == {"tilt": {"low": -0.5, "high": 0.5}}


def test_fields_with_a_default_may_be_missing():
    assert decoded(Wheel, {"radius": 1, "drive": "belt"}, "wheel") == Wheel(1.0, Drive.BELT)
    assert decoded(Range, {"low": 0.0}, "range") == Range(0.0, 1.0)


def test_a_whole_number_becomes_a_float_where_one_is_expected():
    radius = decoded(Wheel, {"radius": 1, "drive": "belt"}, "wheel").radius
    assert isinstance(radius, float)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"name": 3}, "robot.name must be a value of type str; found 3"),
        ({"virtual": 1}, "robot.virtual must be a value of type bool; found 1"),
        ({"wheels": {}}, "robot.wheels must be a list"),
        ({"wheels": [{"radius": "1", "drive": "belt"}]}, r"robot.wheels\[0\].radius must be a value of type float"),
        ({"wheels": [{"radius": 10**400, "drive": "belt"}]}, r"wheels\[0\].radius must be a value of type float"),
        ({"wheels": [{"radius": True, "drive": "belt"}]}, r"wheels\[0\].radius must be .* float; found True"),
        ({"wheels": [{"radius": 1.0, "drive": "chain"}]}, r"wheels\[0\].drive must be one of 'belt', 'gears'"),
        ({"wheels": [{"radius": 1.0, "drive": []}]}, r"wheels\[0\].drive must be one of"),
        ({"wheels": [{"radius": 1.0}]}, r"robot.wheels\[0\] lacks 'drive'; its fields are: radius, drive, turns"),
        ({"ranges": {"tilt": {"low": 0.0, "mid": 0.0}}}, "robot.ranges.tilt has the unknown field 'mid'"),
        ({"ranges": []}, "robot.ranges must be a record"),
        ({"notes": {"mass": None}}, "robot.notes.mass must be a value of type str; found None"),
    ],
)
def test_what_is_no_such_record_is_refused_by_its_place(tmp_path, change, message):
    (tmp_path / "robot.json").write_text(json.dumps({**encoded(ROBOT), **change}))
    with pytest.raises(DataError, match=message):
        read_record(Robot, tmp_path / "robot.json")


def test_numbers_that_json_does_not_know_are_not_written(tmp_path):
    with pytest.raises(ValueError, match="JSON compliant"):
        write_record(tmp_path / "range.json", Range(float("nan")))
    assert not (tmp_path / "range.json").exists()
