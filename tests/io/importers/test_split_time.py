"""A time in two columns, seconds and a fraction of a second, as ROS and the clocks of Linux write it."""

import json

import numpy as np
import pytest
import yaml
from foreign_logs import PERIOD, columns, text

from twbal.core.channels import Channels
from twbal.core.episode import Provenance
from twbal.io.importers.all_columns import all_columns
from twbal.io.importers.conversion import Wanted, import_file
from twbal.io.importers.guess import guess
from twbal.io.importers.mapping import mapping
from twbal.io.importers.measured_columns import seconds_of

ROWS = columns()
BEGIN = 1714739695  # s; when the log began, as a clock of Unix counts
STEP = 10_000_019  # ns; of rows, so that no two fractions are alike
STAMPS = BEGIN * 10**9 + 123_456_789 + STEP * np.arange(len(ROWS), dtype=np.int64)
PAIRS = {
    "header.stamp": ("header.stamp.sec", "header.stamp.nanosec", 9),
    "topic": ("/imu/data/header/stamp/secs", "/imu/data/header/stamp/nsecs", 9),
    "sec": ("sec", "nsec", 9),
    "stamp": ("stamp_sec", "stamp_nanosec", 9),
    "camel": ("stampSec", "stampNanoSec", 9),
    "unit": ("time_s", "time_ns", 9),
    "brackets": ("stamp [s]", "stamp [ns]", 9),
    "tv": ("tv_sec", "tv_usec", 6),
    "words": ("seconds", "microseconds", 6),
    "milliseconds": ("time_sec", "time_msec", 3),
}
SENSORS = {"pitch": ROWS[:, 1], "wheel_angle": ROWS[:, 5], "torque": ROWS[:, 7]}


def parts(names):
    """The stamps as whole seconds and a whole fraction, each by its name; and the time that they tell [s]."""
    seconds, fraction, digits = names
    units = STAMPS // 10 ** (9 - digits)
    whole, rest = units // 10**digits, units % 10**digits
    return {seconds: whole, fraction: rest}, (units - units[0]) / 10.0**digits


def proposed(path):
    found = guess(path)
    return yaml.safe_load(found.mapping), found


def written(tmp_path, named):
    path = tmp_path / "log.json"
    path.write_text(json.dumps({name: np.asarray(values).tolist() for name, values in named.items()}))
    return path


@pytest.mark.parametrize("kind", PAIRS)
def test_seconds_and_their_fraction_are_one_time(kind, tmp_path):
    stamps, _ = parts(PAIRS[kind])
    described, found = proposed(written(tmp_path, {**stamps, **SENSORS}))
    scale = [2, 2.0 / 10 ** PAIRS[kind][2]]
    assert described["quantities"]["time"] == {"from": list(stamps), "unit": "s", "scale": scale}
    assert not any("time" in each for each in found.open) and "time" not in found.unknown_units


@pytest.mark.parametrize("kind", ["header.stamp", "tv"])
def test_the_import_takes_the_time_as_both_columns_tell_it(kind, tmp_path):
    """To a double's last digit, which is 0.24 µs of a time since 1970."""
    stamps, seconds = parts(PAIRS[kind])
    path = written(tmp_path, {**stamps, **SENSORS})
    described, _ = proposed(path)
    del described["_target_"]
    chosen = mapping(**described)
    wanted = Wanted(lambda period: Channels(("tilt", "tilt_rate", "speed", "command_1"), 0.1), None, 50)
    (episode,) = import_file(path, chosen, wanted, Provenance("mine", "robot")).episodes
    assert np.abs(episode.observations[:, 0] - seconds).max() < 5e-7
    assert episode.control_period == pytest.approx(PERIOD, rel=1e-5)


def test_columns_in_a_text_file_are_one_time_too(tmp_path):
    stamps, _ = parts(PAIRS["header.stamp"])
    named = {**stamps, **SENSORS}
    path = tmp_path / "log.csv"
    path.write_text(
        "\n".join(
            [
                ",".join(named),
                *(",".join(map(repr, row)) for row in zip(*map(np.ndarray.tolist, named.values()), strict=True)),
            ]
        )
    )
    described, _ = proposed(path)
    assert described["quantities"]["time"] == {"from": list(stamps), "unit": "s", "scale": [2, 2e-9]}


def test_units_of_rates_are_told_by_the_time_in_two_columns(tmp_path):
    stamps, seconds = parts(PAIRS["header.stamp"])
    path = written(tmp_path, {**stamps, **SENSORS, "gyro_y": np.degrees(ROWS[:, 2])})
    assert seconds_of(all_columns(path)) == pytest.approx(BEGIN + 0.123456789 + seconds, abs=1e-6)
    described, _ = proposed(path)
    assert described["quantities"]["tilt_rate"] == {"from": "gyro_y", "unit": "deg/s"}


def test_a_time_in_two_units_is_no_pair(tmp_path):
    named = {"time_s": ROWS[:, 0], "time_ms": np.round(1e3 * ROWS[:, 0]), **SENSORS}
    described, _ = proposed(written(tmp_path, named))
    assert described["quantities"]["time"] == {"from": "time_s", "unit": "s"}


def test_whole_seconds_beside_all_microseconds_are_no_pair(tmp_path):
    named = {"time_s": np.floor(ROWS[:, 0]), "time_us": np.round(1e6 * ROWS[:, 0]), **SENSORS}
    described, _ = proposed(written(tmp_path, named))
    assert not isinstance(described["quantities"]["time"]["from"], list)


@pytest.mark.parametrize("other", ["Time", "two"])
def test_two_times_are_left_to_a_person_with_both_columns_of_a_pair(other, tmp_path):
    stamps, seconds = parts(PAIRS["topic"])
    more = {"Time": seconds} if other == "Time" else parts(("/wheel/stamp/secs", "/wheel/stamp/nsecs", 9))[0]
    described, found = proposed(written(tmp_path, {**more, **stamps, **SENSORS}))
    assert described["quantities"]["time"]["from"] == "???"
    (reason,) = (each for each in found.open if each.startswith("time"))
    assert "/imu/data/header/stamp/secs with /imu/data/header/stamp/nsecs" in reason and next(iter(more)) in reason


def test_a_pair_that_runs_backwards_is_the_reason_why_it_is_not_taken(tmp_path):
    stamps, _ = parts(PAIRS["sec"])
    order = np.arange(len(ROWS))
    order[10:-10:20], order[11:-9:20] = order[11:-9:20].copy(), order[10:-10:20].copy()
    _, found = proposed(written(tmp_path, {**{name: each[order] for name, each in stamps.items()}, **SENSORS}))
    assert "time (sec with nsec runs backwards 19 times: are the rows in order?)" in found.open


def test_a_second_alone_is_as_before(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(text(np.column_stack([ROWS[:, 0], *SENSORS.values()]), names=("sec", *SENSORS)))
    assert proposed(path)[0]["quantities"]["time"]["from"] == "sec"
