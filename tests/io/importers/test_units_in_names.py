"""Units in names, however people write them: a rate is no time, and what is known has its unit."""

import numpy as np
import pytest
import yaml
from foreign_logs import columns, text

from twbal.io.importers.column_names import meaning_of
from twbal.io.importers.column_units import is_unit
from twbal.io.importers.guess import guess

ROWS = columns()
FORMS = ["{} [{}]", "{} ({})", "{}_{}", "{} {}"]
PER_SECOND = [
    *[("deg/sec", "deg/s"), ("rad/sec", "rad/s"), ("degrees/sec", "deg/s"), ("°/sec", "°/s"), ("deg/second", "deg/s")],
    *[("degrees/s", "deg/s"), ("radians/s", "rad/s"), ("radians/second", "rad/s"), ("Deg/Sec", "deg/s")],
    *[("rev/s", "turn/s"), ("revs/sec", "turn/s"), ("rps", "turn/s"), ("RPM", "rpm"), ("turn/s", "turn/s")],
]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("unit", "means"), PER_SECOND)
def test_a_gyro_in_any_unit_of_a_rate_is_a_rate(form, unit, means):
    meaning = meaning_of(form.format("gyro_y", unit))
    assert (meaning.quantity, meaning.unit, meaning.certain) == ("tilt_rate", means, True)
    assert meaning_of(form.format("yaw", unit))[:2] == ("yaw_rate", True)
    assert meaning_of(form.format("wheel", unit))[:2] == ("wheel_rate", True)
    assert is_unit(unit)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("unit", ["m/sec", "m/s", "m/second", "mm/sec"])
def test_a_speed_of_the_way_is_no_time_and_no_rate_of_its_wheels(form, unit):
    meaning = meaning_of(form.format("wheel_speed", unit))
    assert meaning.quantity == "wheel_rate" and meaning.unit == unit.split("/")[0] + "/s"


@pytest.mark.parametrize(
    ("name", "quantity", "unit"),
    [
        *[(f"acceleration {form}", "acceleration", "m/s²") for form in ("[m/s^2]", "(m/s2)", "m/s²", "[m/s/s]")],
        *[("acceleration_m/s^2", "acceleration", "m/s²"), ("acc_x [m/sec^2]", "acceleration", "m/s²")],
        *[(f"torque {form}", "command", "N·m") for form in ("[N.m]", "(N.m)", "N.m", "[n.m]")],
        *[("torque_N.m", "command", "N·m"), ("torque [mN.m]", "command", "mNm")],
        *[("wheel_angle [rev]", "wheel_angle", "turn"), ("wheel [revolutions]", "wheel_angle", "turn")],
        *[("wheel_angle_turns", "wheel_angle", "turn"), ("pitch [degrees]", "tilt", "deg")],
        *[("pitch [radians]", "tilt", "rad"), ("gyro (body) [deg/s]", "tilt_rate", "deg/s")],
    ],
)
def test_other_units_are_known(name, quantity, unit):
    meaning = meaning_of(name)
    assert (meaning.quantity, meaning.unit) == (quantity, unit)


@pytest.mark.parametrize(
    "name",
    [
        *["gyro_y foo/sec", "yaw ms", "encoder sec", "wheel_speed_sec", "motor t", "pitch_us", "lean (sec)"],
        *["gyro_time", "encoder stamp", "rpm_millis", "deg/sec", "wheel ticks/sec", "body rate [x/sec]"],
    ],
)
def test_a_column_of_a_motion_is_never_the_time(name):
    assert meaning_of(name).quantity != "time"


@pytest.mark.parametrize("name", ["encoder_l [ticks/s]", "encoder_l ticks/sec", "left encoder [counts/second]"])
def test_counts_over_seconds_are_a_rate(name):
    meaning = meaning_of(name)
    assert (meaning.quantity, meaning.certain, meaning.side) == ("wheel_rate", True, "left")


@pytest.mark.parametrize(
    "name", ["time", "t", "sec", "/imu/data/header/stamp", "header.stamp.sec", "time_ms", "loop time [us]", "elapsed_s"]
)
def test_a_time_stays_one(name):
    meaning = meaning_of(name)
    assert (meaning.quantity, meaning.certain) == ("time", True)


def test_no_column_of_a_log_with_such_units_is_dropped(tmp_path):
    names = ("time [sec]", "pitch [deg]", "gyro_y [deg/sec]", "yaw rate (rad/sec)", "wheel [rev]", "torque [N.m]")
    degrees = np.degrees(ROWS[:, 1:3])
    rows = np.column_stack([ROWS[:, 0], degrees, ROWS[:, 4], ROWS[:, 5] / (2.0 * np.pi), ROWS[:, 7]])
    (tmp_path / "log.csv").write_text(text(rows, names=names))
    found = guess(tmp_path / "log.csv")
    quantities = yaml.safe_load(found.mapping)["quantities"]
    assert {name: (told["from"], told["unit"]) for name, told in quantities.items() if told} == {
        **{"time": (names[0], "s"), "tilt": (names[1], "deg"), "tilt_rate": (names[2], "deg/s")},
        **{"yaw_rate": (names[3], "rad/s"), "wheel_angle": (names[4], "turn"), "command": (names[5], "N·m")},
    }
    assert found.open == () and found.unknown_units == ()
