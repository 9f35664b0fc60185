"""A proposed mapping is right or says what is open: names, sides, units, comments, and tables that twbal wrote."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from foreign_logs import columns, text

from twbal.core.errors import LogError
from twbal.io.importers.guess import guess
from twbal.io.importers.remaining_entries import KnownMapping

ROWS = columns()
MEASURED = Path(__file__).resolve().parents[4] / "shared" / "measured"
COLUMN = {name: ROWS[:, k] for k, name in enumerate(("t", "tilt", "rate", "a", "yaw", "wheel", "wheel_rate", "u"))}


def proposed(path):
    found = guess(path)
    return yaml.safe_load(found.mapping), found


@pytest.fixture
def looked_at(tmp_path):
    def look(**named):
        path = tmp_path / "log.csv"
        path.write_text(text(np.column_stack(list(named.values())), names=tuple(named)))
        return proposed(path)

    return look


def plain(**more):
    return {"time": COLUMN["t"], "tilt": COLUMN["tilt"], "wheel_angle": COLUMN["wheel"], **more}


def test_a_log_of_a_gyro_needs_no_tilt_and_the_axes_of_its_accelerometer_are_asked_for(looked_at):
    log = {name: values for name, values in plain(torque=COLUMN["u"], pitch_rate=COLUMN["rate"]).items()}
    del log["tilt"]
    mapping, found = looked_at(**log)
    assert mapping["quantities"]["tilt"] is None and mapping["quantities"]["tilt_rate"]["from"] == "pitch_rate"
    assert not found.open
    mapping, found = looked_at(**log, acc_x=COLUMN["a"], acc_y=COLUMN["a"], acc_z=9.8 + COLUMN["a"])
    asked = [each for each in found.open if "which of acc_x, acc_y, acc_z" in each]
    assert [each.split()[0] for each in asked] == ["accelerometer_forward", "accelerometer_up"]


def test_time_whose_stamps_come_in_bunches_is_found_and_tells_the_unit_of_a_rate(looked_at):
    stamps = COLUMN["t"][4::5].repeat(5)
    degrees = np.degrees(COLUMN["rate"])
    mapping, _ = looked_at(**{**plain(torque=COLUMN["u"], gyro_y=degrees), "time": stamps})
    assert mapping["quantities"]["time"]["from"] == "time"
    assert mapping["quantities"]["tilt_rate"] == {"from": "gyro_y", "unit": "deg/s"}


def test_a_left_and_a_right_torque_become_their_sum(looked_at):
    mapping, found = looked_at(**plain(torque_left=COLUMN["u"], torque_right=COLUMN["u"]))
    command = mapping["quantities"]["command"]
    assert command["from"] == ["torque_left", "torque_right"]
    assert command["scale"] == 2
    assert "their sum" in found.mapping


def test_wheels_of_which_nothing_is_known_for_sure_are_asked_for(looked_at):
    """`phi` may be an angle of the wheels; a rate that may be another's is no reason to go without it."""
    names = {"t": "t", "theta": "tilt", "dtheta": "rate", "phi": "wheel", "dphi": "wheel_rate", "u": "u"}
    mapping, found = looked_at(**{name: COLUMN[column] for name, column in names.items()})
    assert mapping["quantities"]["wheel_angle"] is not None
    assert any("wheel_angle" in each for each in found.open)


def test_the_ending_of_a_file_may_be_in_capital_letters(tmp_path):
    path = tmp_path / "LOG.JSON"
    path.write_text(json.dumps({name: values.tolist() for name, values in plain(torque=COLUMN["u"]).items()}))
    mapping, _ = proposed(path)
    assert mapping["quantities"]["tilt"]["from"] == "tilt"


def test_wheels_and_voltages_become_their_mean(looked_at):
    wheels, volts = {"encL": "wheel", "encR": "wheel"}, {"motor_left_v": "u", "motor_right_v": "u"}
    mapping, _ = looked_at(
        time=COLUMN["t"], tilt=COLUMN["tilt"], **{name: COLUMN[column] for name, column in {**wheels, **volts}.items()}
    )
    assert mapping["quantities"]["wheel_angle"] == {"from": ["encL", "encR"], "unit": "rad"}
    assert mapping["quantities"]["voltage"] == {"from": ["motor_left_v", "motor_right_v"], "unit": "V"}


AMBIGUOUS = {
    "pitch or roll?": ("tilt", {"pitch": "tilt", "roll": "tilt", "torque": "u"}),
    "gyro_x or gyro_y?": ("tilt_rate", {"tilt": "tilt", "gyro_x": "rate", "gyro_y": "rate", "gyro_z": "yaw"}),
    "torque_left is of one wheel only": ("command", {"tilt": "tilt", "torque_left": "u"}),
    "torque_filtered or torque_raw?": ("command", {"tilt": "tilt", "torque_filtered": "u", "torque_raw": "u"}),
    "perhaps enc1 or enc2": ("wheel_angle", {"tilt": "tilt", "enc1": "wheel", "enc2": "wheel"}),
    "perhaps theta": ("tilt", {"theta": "tilt", "wheel_angle": "wheel"}),
    "perhaps u": ("command", {"tilt": "tilt", "wheel_angle": "wheel", "u": "u"}),
}


@pytest.mark.parametrize("reason", AMBIGUOUS)
def test_what_may_be_one_or_another_is_left_open(reason, looked_at):
    quantity, names = AMBIGUOUS[reason]
    mapping, found = looked_at(time=COLUMN["t"], **{name: COLUMN[column] for name, column in names.items()})
    assert mapping["quantities"][quantity]["from"] == "???"
    assert any(line.startswith(f"{quantity} ({reason}") for line in found.open)


def test_a_column_called_command_is_left_open_and_the_reason_says_how_to_go_on(looked_at):
    mapping, found = looked_at(**plain(command=COLUMN["u"]))
    assert mapping["quantities"]["command"]["from"] == "???"
    (reason,) = (line for line in found.open if line.startswith("command"))
    assert "If it is the torque of both wheels" in reason and "fill in its name and unit" in reason
    assert "belongs to `voltage`" in reason


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        *(("torque (N m)", "N·m"), ("torque [N·m]", "N·m"), ("torque [N*m]", "N·m"), ("torque [Nm]", "N·m")),
        *(("torque [mN·m]", "mNm"), ("torque [mN m]", "mNm")),
    ],
)
def test_a_torque_has_its_unit_however_that_is_written(name, unit, looked_at):
    mapping, found = looked_at(**plain(**{name: COLUMN["u"]}))
    assert mapping["quantities"]["command"] == {"from": name, "unit": unit}
    assert "command" not in found.unknown_units


@pytest.mark.parametrize("name", ["cmd_vel", "torque_ref", "pitch_kp", "state_command_1", "motor_current"])
def test_columns_about_a_quantity_are_not_taken_for_it(name, looked_at):
    mapping, found = looked_at(**plain(**{name: COLUMN["u"]}))
    assert name not in json.dumps(mapping)
    assert any(line.startswith("command") for line in found.open)


@pytest.mark.parametrize(
    ("largest", "unit", "open_ones"), [(90, "%", ("motor",)), (255, "V", ("scale of voltage", "motor"))]
)
def test_a_duty_cycle_is_in_percent_where_its_numbers_are(largest, unit, open_ones, looked_at):
    mapping, found = looked_at(**plain(duty=largest * COLUMN["u"]))
    assert mapping["quantities"]["voltage"]["unit"] == unit
    assert found.open == open_ones


def test_whole_numbers_above_100_are_no_percent(looked_at):
    """Of an Arduino's timer, whose full value is 255, of which a robot that stands uses less than half."""
    mapping, found = looked_at(**plain(pwm=np.round(115 * COLUMN["u"])))
    assert mapping["quantities"]["voltage"]["scale"] == "???"
    assert found.open == ("scale of voltage", "motor")


@pytest.mark.parametrize(
    ("name", "largest", "unit"),
    [("pwm", 78, "V"), ("pwm [-255..255]", 78, "V"), ("pwm [%]", 78, "%"), ("duty", 78, "%"), ("duty [%]", 140, "%")],
)
def test_whole_numbers_are_percent_where_their_name_says_so(name, largest, unit, looked_at):
    """A gentle drive uses less than 100 of a timer's 255 steps."""
    mapping, found = looked_at(**plain(**{name: np.round(largest * COLUMN["u"] / np.abs(COLUMN["u"]).max())}))
    assert mapping["quantities"]["voltage"]["unit"] == unit
    assert mapping["quantities"]["voltage"].get("scale") == (None if unit == "%" else "???")
    assert found.open == (("motor",) if unit == "%" else ("scale of voltage", "motor"))


@pytest.mark.parametrize(
    ("name", "largest", "full"),
    [
        ("pwm", 254, 255),
        ("pwm", 400, 400),
        ("pwm", 1000, 1000),
        ("pwm", 1023, 1023),
        ("duty", 0.8, 1),
        ("duty", 90, 100),
    ],
)
def test_a_proposal_has_the_torque_limit_over_the_full_value_worked_out(
    name, largest, full, looked_at, paper, tmp_path
):
    duty = largest * COLUMN["u"] / np.abs(COLUMN["u"]).max()
    looked_at(**plain(**{name: np.round(duty) if name == "pwm" else duty}))
    found = guess(tmp_path / "log.csv", paper)
    assert found.is_duty and f"scale: {20.0 / full:.6g}}}  # 20 N·m / full duty {full}" in found.mapping
    looked_at(**plain(torque=COLUMN["u"]))
    assert "full duty" not in guess(tmp_path / "log.csv", paper).mapping


@pytest.mark.parametrize(
    ("largest", "asked"), [(225, "255? 400? 1000? "), (300, "400? 1000? 1023? "), (1010, "1023? 4095? 65535? ")]
)
def test_a_full_value_that_the_log_does_not_reach_is_asked_for(largest, asked, looked_at, paper, tmp_path):
    looked_at(**plain(pwm=np.round(largest * COLUMN["u"] / np.abs(COLUMN["u"]).max())))
    said = f"scale: '???'}}  # torque_limit (20 N·m) / full duty; full duty {asked}the largest seen is {largest}"
    assert said in guess(tmp_path / "log.csv", paper).mapping


@pytest.mark.parametrize("unit", ["ticks", "counts", "steps"])
def test_encoders_whose_header_says_that_they_count_are_taken_with_a_scale_to_fill_in(unit, looked_at):
    encoder = np.round(500 * np.cumsum(COLUMN["u"]))
    columns = {f"enc_l [{unit}]": encoder, f"enc_r [{unit}]": encoder + 3.0}
    mapping, found = looked_at(time=COLUMN["t"], tilt=COLUMN["tilt"], torque=COLUMN["u"], **columns)
    assert mapping["quantities"]["wheel_angle"] == {"from": list(columns), "unit": "rad", "scale": "???"}
    assert "scale of wheel_angle" in found.open


def test_a_growing_encoder_is_not_the_time(looked_at):
    mapping, found = looked_at(encoder=10.0 * np.arange(400), tilt=COLUMN["tilt"], torque=COLUMN["u"])
    assert mapping["quantities"]["time"]["from"] == "???"
    assert any("time" in line and "encoder grows by even steps" in line for line in found.open)
    assert mapping["quantities"]["wheel_angle"]["scale"] == "???"  # counts


@pytest.mark.parametrize(("name", "factor"), [("ms", 1e3), ("us", 1e6), ("MS", 1e3)])
def test_a_column_that_is_called_by_a_unit_of_time_is_the_time(name, factor, looked_at):
    mapping, found = looked_at(**{name: factor * COLUMN["t"]}, tilt=COLUMN["tilt"], wheel_angle=COLUMN["wheel"])
    assert mapping["quantities"]["time"] == {"from": name, "unit": name.lower()}
    assert not any("time" in line for line in found.open)


@pytest.mark.parametrize(("factor", "unit"), [(1, "s"), (1e3, "ms"), (1e6, "us")])
def test_units_of_time_and_large_angles_go_by_their_numbers_and_others_are_not_known(factor, unit, looked_at):
    mapping, found = looked_at(time=factor * COLUMN["t"], pitch=100 * COLUMN["tilt"], wheel_angle=COLUMN["wheel"])
    assert mapping["quantities"]["time"]["unit"] == unit
    assert mapping["quantities"]["tilt"]["unit"] == "deg"
    assert found.unknown_units == ("wheel_angle",)
    assert looked_at(time=COLUMN["t"], pitch=COLUMN["tilt"])[1].unknown_units == ("tilt",)


def test_a_battery_is_no_motor_and_a_speed_in_metres_no_rate(looked_at):
    mapping, found = looked_at(**plain(voltage=12 + 0.01 * COLUMN["u"], **{"wheel_speed [m/s]": COLUMN["wheel_rate"]}))
    assert mapping["quantities"]["command"]["from"] == "???"
    assert mapping["quantities"]["wheel_rate"] is None
    assert "wheel_speed [m/s] is in m/s" in found.mapping


def test_names_that_stand_in_a_comment_are_found(tmp_path):
    path = tmp_path / "log.txt"
    rows = ROWS[:, [0, 1, 5, 7]]
    path.write_text("# by hand\n# time tilt wheel_angle torque\n" + text(rows, " ", names=None))
    mapping, _ = proposed(path)
    assert {name: told["from"] for name, told in mapping["quantities"].items() if told} == {
        **{"time": 1, "tilt": 2, "wheel_angle": 3},
        "command": 4,
    }


NUMBERED = """%% log
%  1    time 3.0 sec, of (81)
%  2  3 Motor voltage [V] left, right: 1.00 1.07
%  4  6 Wheel velocity [m/s] left, right: 0.02 delay 0.02 0.03 (sec)
%  7  8  9 Pose x,y,h [m,m,rad]: 0.87 0.0003 -6e-08
% 10    Body tilt [rad]
"""


def test_numbered_names_are_found_and_a_range_of_them_tells_nothing(tmp_path):
    path = tmp_path / "log.txt"
    rows = ROWS[:, [0, 7, 7, 6, 6, 6, 5, 4, 4, 1]]
    path.write_text(NUMBERED + text(rows, " ", names=None))
    mapping, found = proposed(path)
    sources = {name: told["from"] for name, told in mapping["quantities"].items() if told}
    assert sources == {"time": 1, "voltage": [2, 3], "x": 7, "y": 8, "heading": 9, "tilt": 10}
    assert found.open == ("motor",)


@pytest.mark.skipif(not MEASURED.exists(), reason="the logs of real robots are not here")
def test_logs_of_real_robots_are_told_as_their_owners_describe_them():
    described = yaml.safe_load((Path(__file__).resolve().parents[3] / "conf/groups/import.yaml").read_text())["regbot"]
    for path in sorted((MEASURED / "regbot").glob("*.txt")):
        mapping, found = proposed(path)
        assert mapping["quantities"] == described["quantities"]
        is_driven = "test0" not in path.name  # there the wheels turn in the air, at one speed
        assert mapping["command_is_sample"] == ("???" if is_driven else False)
        assert [entry.split(" (")[0] for entry in found.open] == ["motor", *["command_is_sample"] * is_driven]
        known = yaml.safe_load(guess(path, known=KnownMapping("regbot", described)).mapping)
        assert {key: known[key] for key in ("motor", "command_is_sample", "skip")} == {
            key: described[key] for key in ("motor", "command_is_sample", "skip")
        }
    mapping, found = proposed(MEASURED / "segway_ev3" / "datalog.json")
    assert {name: told["from"] for name, told in mapping["quantities"].items() if told} == {
        "time": "tLoopStart",
        "tilt": "gyroEstimatedAngle",
        "tilt_rate": "gyroRate",
        "wheel_angle": "motorAngle",
        "voltage": "motorDutyCycle",
    }
    assert mapping["quantities"]["voltage"]["unit"] == "%"
    assert "motorAngularSpeed is the mean rate of motorAngle over the last 5 rows, 77 ms late" in found.mapping
    assert mapping["command_is_sample"] is False and found.open == ("motor",)


@pytest.mark.parametrize("kind", ["header", "comment", "json"])
def test_control_characters_in_names_reach_neither_a_terminal_nor_the_mapping(kind, tmp_path):
    names = ("time", "\x1b]0;owned\x07tilt", "wheel\x9bangle")
    path = tmp_path / ("log.json" if kind == "json" else "log.txt")
    if kind == "json":
        path.write_text(json.dumps({name: column.tolist() for name, column in zip(names, ROWS.T, strict=False)}))
    elif kind == "header":
        path.write_text(text(ROWS[:, :3], names=names), encoding="latin-1")
    else:
        path.write_text("% " + " ".join(names) + "\n" + text(ROWS[:, :3], " ", names=()), encoding="latin-1")
    mapping, found = proposed(path)
    assert mapping["quantities"]["time"]["from"] in ("time", 1)
    assert all(
        line.replace("\t", " ").isprintable() for line in [*found.table, *found.mapping.splitlines(), *found.open]
    )


def test_a_text_of_which_no_column_has_only_numbers_is_refused(tmp_path):
    (tmp_path / "log.txt").write_text("a b\n1 x\nx 1\n")
    with pytest.raises(LogError, match="no column in which all fields are numbers"):
        guess(tmp_path / "log.txt")


@pytest.mark.parametrize(("factor", "unit"), [(1.0, "rad/s"), (180 / np.pi, "deg/s"), (-180 / np.pi, "deg/s")])
@pytest.mark.parametrize("degrees", [False, True])
def test_the_unit_of_a_gyro_goes_by_the_changes_of_the_tilt(factor, unit, degrees, looked_at):
    rng, size = np.random.default_rng(3), 100 if degrees else 1  # degrees are told by a largest value above 3.5
    noise = 0.02 * rng.standard_normal(len(ROWS))
    gyro = factor * (size * np.pi / 180 if degrees else 1) * (COLUMN["rate"] + noise + 0.01)
    mapping, found = looked_at(time=COLUMN["t"], tilt=size * COLUMN["tilt"], gyro_y=gyro, torque=COLUMN["u"])
    assert mapping["quantities"]["tilt_rate"] == {"from": "gyro_y", "unit": unit}
    is_told = degrees or unit != "rad/s"  # else both may be in degrees
    assert ("unit by the changes of tilt" in found.mapping) == is_told
    assert ("tilt_rate" not in found.unknown_units) == is_told


def test_the_other_axes_of_a_gyro_have_its_unit(looked_at):
    degrees = 180 / np.pi
    gyro = {"gyro_y": degrees * COLUMN["rate"], "gyro_z": degrees * COLUMN["yaw"]}
    mapping, found = looked_at(**plain(**gyro))
    assert mapping["quantities"]["yaw_rate"] == {"from": "gyro_z", "unit": "deg/s"}
    assert "unit as that of gyro_y" in found.mapping and "yaw_rate" not in found.unknown_units
    mapping, _ = looked_at(**plain(gyro_y=degrees * COLUMN["rate"], yaw_speed=COLUMN["yaw"]))
    assert mapping["quantities"]["yaw_rate"]["unit"] == "rad/s"


def test_a_gyro_that_is_no_rate_of_the_tilt_has_no_known_unit(looked_at):
    gyro = np.random.default_rng(4).standard_normal(len(ROWS))
    _, found = looked_at(time=COLUMN["t"], tilt=COLUMN["tilt"], gyro_y=gyro, torque=COLUMN["u"])
    assert "tilt_rate" in found.unknown_units


def test_a_gyro_beside_a_tilt_that_may_be_in_degrees_has_no_known_unit(looked_at):
    tilt, gyro = 40 * COLUMN["tilt"], 40 * COLUMN["rate"]  # degrees, of a robot that hardly moves
    _, found = looked_at(time=COLUMN["t"], tilt=tilt, gyro_y=gyro, torque=COLUMN["u"])
    assert {"tilt", "tilt_rate"} <= set(found.unknown_units)


@pytest.mark.parametrize("radius", [0.03, 0.05, 0.08, 0.1, 0.12, 0.15, 0.2])
@pytest.mark.parametrize("per_metre", [1.0, 100.0, 1000.0])
def test_a_speed_of_the_wheels_way_is_no_rate(radius, per_metre, looked_at):
    turned = np.rad2deg(COLUMN["wheel"])
    speeds = dict.fromkeys(("speed_l", "speed_r"), per_metre * radius * COLUMN["wheel_rate"])
    mapping, _ = looked_at(time=COLUMN["t"], tilt=COLUMN["tilt"], wheel_angle_deg=turned, **speeds)
    assert mapping["quantities"]["wheel_rate"] is None


@pytest.mark.parametrize("name", ["r_dps", "r (rad/s)", "l_rpm"])
def test_a_letter_alone_is_no_side(name, looked_at):
    mapping, _ = looked_at(**plain(**{name: COLUMN["yaw"]}))
    assert mapping["quantities"]["wheel_rate"] is None


@pytest.mark.parametrize("names", [("rpm_l", "rpm_r"), ("left_rpm", "right_rpm"), ("rpm_left", "rpm_right")])
def test_a_left_and_a_right_rate_are_the_wheels(names, looked_at):
    turned = np.rad2deg(COLUMN["wheel"])
    rates = dict.fromkeys(names, COLUMN["wheel_rate"] * 30 / np.pi)
    mapping, _ = looked_at(time=COLUMN["t"], tilt=COLUMN["tilt"], wheel_angle_deg=turned, **rates)
    assert mapping["quantities"]["wheel_rate"] == {"from": list(names), "unit": "rpm"}


def test_a_unit_with_a_slash_is_part_of_no_name(looked_at):
    mapping, _ = looked_at(**plain(**{"gyro_y_deg/s": COLUMN["rate"]}))
    assert mapping["quantities"]["tilt_rate"] == {"from": "gyro_y_deg/s", "unit": "deg/s"}


def test_the_axis_of_a_gyro_that_the_tilt_changes_by_is_taken(looked_at):
    rng = np.random.default_rng(5)
    gyro = {"gyro_x": 0.02 * rng.standard_normal(len(ROWS)), "gyro_y": COLUMN["rate"], "gyro_z": COLUMN["yaw"]}
    mapping, found = looked_at(**plain(**gyro))
    assert mapping["quantities"]["tilt_rate"]["from"] == "gyro_y"
    assert "of gyro_x and gyro_y the one that tilt changes by" in found.mapping
    assert not any("tilt_rate" in each for each in found.open)


def test_raw_numbers_of_a_gyro_are_taken_with_a_scale_to_fill_in(looked_at):
    """An MPU-6050 at ±250 deg/s gives 131 for one deg/s."""
    raw = {axis: np.round(131 * np.rad2deg(COLUMN[name])) for axis, name in (("gy", "rate"), ("gz", "yaw"))}
    mapping, found = looked_at(time=COLUMN["t"], tilt_deg=np.rad2deg(COLUMN["tilt"]), torque=COLUMN["u"], **raw)
    for quantity in ("tilt_rate", "yaw_rate"):
        assert mapping["quantities"][quantity]["unit"] == "deg/s"
        assert mapping["quantities"][quantity]["scale"] == "???"
        assert f"scale of {quantity}" in found.open
    assert "about 0.0076 by the changes of tilt_deg" in found.mapping


def test_whole_degrees_a_second_need_no_scale(looked_at):
    tilt, rate = 10 * np.rad2deg(COLUMN["tilt"]), np.round(10 * np.rad2deg(COLUMN["rate"]))
    mapping, _ = looked_at(time=COLUMN["t"], tilt_deg=tilt, gyro=rate, torque=COLUMN["u"])
    assert mapping["quantities"]["tilt_rate"] == {"from": "gyro", "unit": "deg/s"}


@pytest.mark.parametrize(("bits", "unit"), [(16, "ms"), (16, "us"), (32, "us")])
def test_a_counter_of_time_that_begins_anew_is_unwrapped(bits, unit, looked_at, tmp_path):
    counter = (np.round(COLUMN["t"] * {"ms": 1e3, "us": 1e6}[unit]) + 2.0**bits - 1000) % 2**bits
    mapping, _ = looked_at(micros=counter, tilt=COLUMN["tilt"], gyro=COLUMN["rate"], wheel_angle=COLUMN["wheel"])
    assert mapping["quantities"]["time"] == {"from": "micros", "unit": unit, "wraps": 2**bits}


def test_a_time_that_begins_at_zero_again_is_of_two_recordings_and_wraps_nowhere(looked_at):
    again = np.concatenate([COLUMN["t"][:200], COLUMN["t"][:200]])
    mapping, _ = looked_at(time=1e3 * again, tilt=COLUMN["tilt"], wheel_angle=COLUMN["wheel"])
    assert mapping["quantities"]["time"] == {"from": "time", "unit": "ms"}


@pytest.mark.parametrize(
    ("wheel", "wraps"),
    [
        (np.round(20000 * COLUMN["wheel"] + 32768) % 65536 - 32768, 65536),
        (np.rad2deg(3 * COLUMN["wheel"]) % 360, 360),
        ((3 * COLUMN["wheel"]) % (2 * np.pi), pytest.approx(2 * np.pi)),
        (COLUMN["wheel"], None),
    ],
)
def test_angles_of_the_wheels_that_begin_anew_at_the_end_of_their_range_are_unwrapped(wheel, wraps, looked_at):
    name = "wheel_angle_deg" if wraps == 360 else "wheel_angle"
    mapping, _ = looked_at(time=COLUMN["t"], tilt=COLUMN["tilt"], torque=COLUMN["u"], **{name: wheel})
    assert mapping["quantities"]["wheel_angle"].get("wraps") == wraps


def test_rows_out_of_order_are_the_reason_why_a_time_is_not_taken(looked_at):
    order = np.arange(len(ROWS))
    order[10:-10:20], order[11:-9:20] = order[11:-9:20].copy(), order[10:-10:20].copy()
    _, found = looked_at(time_ms=1e3 * COLUMN["t"][order], tilt=COLUMN["tilt"], wheel_angle=COLUMN["wheel"])
    assert "time (time_ms runs backwards 19 times: are the rows in order?)" in found.open


def test_a_column_with_words_among_its_numbers_is_named(tmp_path):
    rows = [line.split(",") for line in text(ROWS[:, :2], names=("time", "tilt")).splitlines()]
    for row in rows[5::9]:
        row[1] = "off"
    (tmp_path / "log.csv").write_text("\n".join(map(",".join, rows)) + "\n")
    _, found = proposed(tmp_path / "log.csv")
    assert "tilt (tilt: not all of its fields are numbers)" in found.open


def test_a_quaternion_and_a_current_are_named_with_what_to_do(looked_at):
    quaternion = {f"/imu/orientation/{axis}": COLUMN["tilt"] for axis in "xyzw"}
    mapping, found = looked_at(time=COLUMN["t"], wheel_angle=COLUMN["wheel"], motor_current=COLUMN["u"], **quaternion)
    assert mapping["quantities"]["tilt"]["from"] == mapping["quantities"]["command"]["from"] == "???"
    reasons = "; ".join(found.open)
    assert "are a quaternion: add a column with the pitch, asin(2 (w y - z x))" in reasons
    assert "perhaps motor_current: a current of a motor times torque constant and gear is a torque" in reasons


ROS = {
    **{"/imu/data/header/stamp": "t", "/imu/pitch": "tilt", "/imu/data/angular_velocity/y": "rate"},
    **{"/imu/data/angular_velocity/z": "yaw", "/joint_states/left_wheel_joint/position": "wheel"},
    **{"/joint_states/right_wheel_joint/position": "wheel", "/joint_states/left_wheel_joint/velocity": "wheel_rate"},
    **{"/joint_states/right_wheel_joint/velocity": "wheel_rate", "/joint_states/left_wheel_joint/effort": "u"},
    "/joint_states/right_wheel_joint/effort": "u",
}
ARDUINO = {
    **{"millis": "t", "Angle": "tilt", "AngleRate": "rate", "PosL": "wheel", "PosR": "wheel", "SpeedL": "wheel_rate"},
    **{"SpeedR": "wheel_rate", "PWML": "u", "PWMR": "u"},
}


def test_names_of_topics_are_understood(looked_at):
    mapping, found = looked_at(**{name: COLUMN[column] for name, column in ROS.items()})
    names = list(ROS)
    sources = {name: told["from"] for name, told in mapping["quantities"].items() if told}
    assert sources == {
        **{"time": names[0], "tilt": names[1], "tilt_rate": names[2], "yaw_rate": names[3]},
        **{"wheel_angle": names[4:6], "wheel_rate": names[6:8], "command": "???"},
    }
    assert any(f"perhaps both {names[8]} and {names[9]}" in reason for reason in found.open)


def test_names_that_are_written_as_one_are_understood(looked_at):
    mapping, found = looked_at(**{name: COLUMN[column] for name, column in ARDUINO.items()})
    sources = {name: told["from"] for name, told in mapping["quantities"].items() if told}
    assert sources["tilt"] == "Angle" and sources["tilt_rate"] == "AngleRate"
    assert sources["voltage"] == ["PWML", "PWMR"]
    assert any("perhaps both PosL and PosR" in reason for reason in found.open)
    assert "perhaps both SpeedL and SpeedR" in found.mapping


def test_wheels_of_which_the_name_does_not_say_what_are_named(looked_at):
    _, found = looked_at(time=COLUMN["t"], tilt=COLUMN["tilt"], wheel_left=COLUMN["wheel"], wheel_right=COLUMN["wheel"])
    assert any("wheel_angle (perhaps both wheel_left and wheel_right" in reason for reason in found.open)


def test_without_names_the_reason_asks_for_numbers(tmp_path):
    path = tmp_path / "log.txt"
    path.write_text(text(ROWS[:, :3], names=None))
    _, found = proposed(path)
    assert "tilt (the file has no names of columns: fill in the column's number)" in found.open


@pytest.mark.parametrize(
    ("name", "unit"), [("pitch_est deg", "deg"), ("pitch (Deg)", "deg"), ("pitch [RAD]", "rad"), ("pitch °", "°")]
)
def test_a_unit_behind_a_blank_or_in_capital_letters_is_read(name, unit, looked_at):
    """The tilt is small, so its numbers do not tell that they are degrees."""
    mapping, found = looked_at(time=COLUMN["t"], wheel_angle=COLUMN["wheel"], **{name: COLUMN["tilt"]})
    assert mapping["quantities"]["tilt"] == {"from": name, "unit": unit}
    assert "tilt" not in found.unknown_units


def test_of_the_same_numbers_in_two_units_the_si_unit_is_taken(looked_at):
    names = {"pitch_deg": np.degrees(COLUMN["tilt"]).round(3), "pitch_rad": COLUMN["tilt"]}
    rates = {"gyro_rad_s": COLUMN["rate"], "gyro_deg_s": np.degrees(COLUMN["rate"]).round(3)}
    mapping, _ = looked_at(time=COLUMN["t"], wheel_angle=COLUMN["wheel"], **names, **rates)
    assert mapping["quantities"]["tilt"] == {"from": "pitch_rad", "unit": "rad"}
    assert mapping["quantities"]["tilt_rate"] == {"from": "gyro_rad_s", "unit": "rad/s"}


def test_other_numbers_in_two_units_are_asked_for(looked_at):
    mapping, found = looked_at(
        time=COLUMN["t"], wheel_angle=COLUMN["wheel"], pitch_rad=COLUMN["tilt"], pitch_deg=COLUMN["tilt"]
    )
    assert mapping["quantities"]["tilt"]["from"] == "???"
    assert any("pitch_rad or pitch_deg?" in each for each in found.open)


@pytest.mark.parametrize("fused", ["Complementary Angle", "kalman_angle", "pitch_dmp"])
def test_a_filtered_angle_goes_before_one_of_a_gyro_or_an_accelerometer_alone(fused, looked_at):
    """A sum of gyro rates drifts, and an accelerometer feels the robot's own acceleration."""
    angles = {"Gyroscope Angle": COLUMN["tilt"] + 0.02 * COLUMN["t"], "Accelerometer Angle": COLUMN["tilt"] + 0.1}
    mapping, _ = looked_at(
        time=COLUMN["t"], wheel_angle=COLUMN["wheel"], **{f"{name} (Deg)": v for name, v in angles.items()},
        **{f"{fused} (Deg)": COLUMN["tilt"]},
    )  # fmt: skip
    assert mapping["quantities"]["tilt"] == {"from": f"{fused} (Deg)", "unit": "deg"}


def test_an_angle_by_an_accelerometer_alone_is_no_acceleration_and_asked_for(looked_at):
    mapping, found = looked_at(time=COLUMN["t"], wheel_angle=COLUMN["wheel"], acc_angle=COLUMN["tilt"])
    assert mapping["quantities"]["tilt"]["from"] == "???"
    assert any("perhaps acc_angle" in each for each in found.open)
    assert "acceleration: null\n" in found.mapping


@pytest.mark.parametrize("name", ["elapsed_s", "Time (PST)", "time_utc"])
def test_names_of_a_time_are_understood(name, looked_at):
    mapping, _ = looked_at(**{name: COLUMN["t"]}, tilt=COLUMN["tilt"], wheel_angle=COLUMN["wheel"])
    assert mapping["quantities"]["time"] == {"from": name, "unit": "s"}


@pytest.mark.parametrize(
    "name", ["leftEncoderPulsesPerSec", "encoder_left_pulses_per_s", "left wheel ticks per second"]
)
def test_counts_a_second_are_a_rate_of_the_wheels_with_a_scale_to_fill_in(name, looked_at):
    """Such rates are no whole numbers. Their sum stands in for the angle, which is then not asked for."""
    other = name.replace("left", "right")
    rates = {name: 123.4 * COLUMN["wheel_rate"], other: 123.4 * COLUMN["wheel_rate"]}
    mapping, found = looked_at(time=COLUMN["t"], tilt=COLUMN["tilt"], torque=COLUMN["u"], **rates)
    assert mapping["quantities"]["wheel_rate"]["from"] == [name, other]
    assert mapping["quantities"]["wheel_rate"]["scale"] == "???"
    assert mapping["quantities"]["wheel_angle"] is None
    assert found.open == ("scale of wheel_rate",)


@pytest.mark.parametrize(("name", "unit"), [("gyro_deg_per_s", "deg/s"), ("pitch_rate_rad_per_sec", "rad/s")])
def test_a_unit_with_per_is_a_rate_and_no_time(name, unit, looked_at):
    mapping, _ = looked_at(**plain(torque=COLUMN["u"]), **{name: COLUMN["rate"]})
    assert mapping["quantities"]["tilt_rate"] == {"from": name, "unit": unit}


def test_columns_that_differ_by_a_number_are_asked_for_as_those_of_two_wheels(looked_at):
    duty = {"motor1_pwm": COLUMN["u"], "motor2_pwm": COLUMN["u"]}
    mapping, found = looked_at(time=COLUMN["t"], tilt=COLUMN["tilt"], wheel_angle=COLUMN["wheel"], **duty)
    assert mapping["quantities"]["command"]["from"] == "???"
    assert any("motor1_pwm or motor2_pwm: which is of the left wheel?" in each for each in found.open)


def test_columns_of_one_name_are_told_apart_by_their_numbers(tmp_path):
    path = tmp_path / "log.csv"
    rows = np.column_stack([COLUMN["t"], COLUMN["tilt"], COLUMN["wheel"], COLUMN["u"], 0.5 * COLUMN["tilt"]])
    path.write_text(text(rows, names=("time", "tilt", "wheel_angle", "torque", "tilt")))
    _, found = proposed(path)
    assert "tilt (tilt (column 2) or tilt (column 5)?)" in found.open
    path.write_text(text(rows, names=("time", "tilt", "wheel_angle", "command", "command")))
    (said,) = proposed(path)[1].open
    assert said.startswith("command (perhaps command (column 4) or command (column 5): ")
    assert said.endswith("fill in its number and unit)")


def test_a_column_of_another_length_is_listed_as_passed_over(tmp_path):
    path = tmp_path / "log.json"
    values = {name: column.tolist() for name, column in plain(torque=COLUMN["u"]).items()}
    path.write_text(json.dumps({**values, "tilt": values["tilt"][:-1], "gain": [3.0]}))
    _, found = proposed(path)
    (said,) = [line for line in found.table if "passed over" in line]
    assert said.split()[:3] == ["-", "tilt", "passed"] and "it has 399 values" in said


def test_rows_of_a_json_file_may_be_lists(tmp_path):
    path = tmp_path / "rows.json"
    path.write_text(json.dumps(ROWS.tolist()))
    _, found = proposed(path)
    assert [line.split()[1] for line in found.table] == [f"column:{k}" for k in range(1, ROWS.shape[1] + 1)]
    assert f"{ROWS[1, 1]:.6g}" in found.table[1]


@pytest.mark.parametrize("content", ["[1, 2, 3]", '["pitch", {"pitch": 1}]', "3"])
def test_json_of_another_form_is_refused_with_the_forms_that_are_read(content, tmp_path):
    path = tmp_path / "rows.json"
    path.write_text(content)
    with pytest.raises(LogError, match="neither an object of lists nor a list of objects or lists"):
        guess(path)


def test_rates_of_two_numbered_wheels_are_the_reason_where_no_angle_is_found(looked_at):
    rates = {f"motor{k}_encoder_pulses_per_s": 123.4 * COLUMN["wheel_rate"] for k in (1, 2)}
    _, found = looked_at(time=COLUMN["t"], tilt=COLUMN["tilt"], torque=COLUMN["u"], **rates)
    (reason,) = found.open
    assert reason.startswith("wheel_angle (perhaps motor1_encoder_pulses_per_s or motor2_encoder_pulses_per_s")
    assert "rate of the wheels" in reason


@pytest.mark.parametrize("of_gyro", [0.1, 1.0])
def test_hundredths_of_a_degree_are_no_degrees(of_gyro, looked_at):
    """The gyro's scale is then known beside that of the tilt alone."""
    pitch, gyro = np.rad2deg(4.0 * COLUMN["tilt"]) / 0.01, np.rad2deg(4.0 * COLUMN["rate"]) / of_gyro
    mapping, found = looked_at(**{**plain(gyro_y=np.round(gyro), torque=COLUMN["u"]), "tilt": np.round(pitch)})
    assert mapping["quantities"]["tilt"] == {"from": "tilt", "unit": "deg", "scale": "???"}
    assert "0.01 if in hundredths of a degree" in found.mapping and "scale of tilt" in found.open
    assert mapping["quantities"]["tilt_rate"] == {"from": "gyro_y", "unit": "deg/s", "scale": "???"}
    assert f"about {of_gyro / 0.01:.2g} × the scale of tilt" in found.mapping


@pytest.mark.parametrize("middle", [0.0, 90.0, 180.0, 270.0, -180.0])
def test_a_tilt_that_is_counted_from_elsewhere_is_in_degrees_still(middle, looked_at):
    mapping, _ = looked_at(**{**plain(torque=COLUMN["u"]), "tilt": middle + 10.0 * np.rad2deg(COLUMN["tilt"])})
    assert mapping["quantities"]["tilt"] == {"from": "tilt", "unit": "deg"}


@pytest.mark.parametrize("counted", [True, False])
def test_encoders_of_which_one_counts_backward_are_seen(counted, looked_at):
    turn = 0.1 * np.sin(0.4 * COLUMN["t"])  # the robot turns a little
    left, right = COLUMN["wheel"] - turn, -(COLUMN["wheel"] + turn)
    columns = {"enc_l": np.round(500 * left), "enc_r": np.round(500 * right)}
    if not counted:
        columns = {"wheel_angle_left_rad": left, "wheel_angle_right_rad": right}
    mapping, found = looked_at(time=COLUMN["t"], tilt=COLUMN["tilt"], torque=COLUMN["u"], **columns)
    assert mapping["quantities"]["wheel_angle"]["scale"] == ("???" if counted else [1, -1])
    advice = "write [s, -s] in the place of a scale s" if counted else "hence the two scales"
    assert f"{list(columns)[1]} counts backward: {advice}" in found.mapping


def test_a_robot_that_turns_on_the_spot_has_no_encoder_that_counts_backward(looked_at):
    swing, turn = 0.2 * np.sin(12.0 * COLUMN["t"]), 2.0 * COLUMN["t"] + np.sin(1.5 * COLUMN["t"])
    mapping, found = looked_at(
        time=COLUMN["t"],
        tilt=COLUMN["tilt"],
        torque=COLUMN["u"],
        left_wheel_rad=swing - turn,
        right_wheel_rad=swing + turn,
    )
    assert mapping["quantities"]["wheel_angle"]["from"] == ["left_wheel_rad", "right_wheel_rad"]
    assert "counts backward" not in found.mapping
