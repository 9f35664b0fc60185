"""A rate of the wheels that comes late is left out, with the reason; one of its row is taken."""

import numpy as np
import pytest
import yaml
from foreign_logs import PERIOD, text

from twbal.io.importers.guess import guess

TICK = 2 * np.pi / 720
ROWS = 600


@pytest.fixture
def looked_at(tmp_path):
    def look(rate, **more):
        columns = {"time": PERIOD * np.arange(ROWS), "tilt": 0.05 * np.sin(np.arange(ROWS) / 20), **more}
        path = tmp_path / "log.csv"
        path.write_text(text(np.column_stack([*columns.values(), rate]), names=(*columns, "wheel_speed [rad/s]")))
        found = guess(path).mapping
        return yaml.safe_load(found)["quantities"]["wheel_rate"], found

    return look


@pytest.fixture
def turned():
    """(ROWS + 20,) an angle of wheels that turn back and forth, by chance; the last ROWS are those of a log."""
    rng = np.random.default_rng(1)
    rates = np.convolve(rng.standard_normal(ROWS + 39), np.hanning(20), mode="valid")
    return TICK * np.floor(np.cumsum(3.0 * PERIOD * rates) / TICK)


@pytest.mark.parametrize("rows", [1, 2, 5, 10])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_mean_over_many_rows_is_left_out_and_one_over_few_is_taken(rows, sign, looked_at, turned):
    rate = sign * (turned[20:] - turned[20 - rows : -rows]) / (rows * PERIOD)
    found, mapping = looked_at(rate, wheel_angle=turned[20:])
    is_late = rows > 2
    assert (found is None) == is_late
    assert (f"mean rate of wheel_angle over the last {rows} rows, {5 * rows} ms late" in mapping) == is_late


def test_ticks_and_a_pose_tell_it_as_well(looked_at, turned):
    rate = (turned[20:] - turned[15:-5]) / (5 * PERIOD)
    assert looked_at(rate, enc_ticks=np.round(turned[20:] / TICK))[0] is None
    pose = {"pose_x": 0.03 * turned[20:], "pose_y": np.zeros(ROWS), "pose_h": np.zeros(ROWS)}
    assert looked_at(rate, **pose)[0] is None


@pytest.mark.parametrize(("seconds", "is_late"), [(0.0, False), (0.005, False), (0.05, True)])
def test_a_filtered_rate_is_left_out_where_its_filter_is_slow(seconds, is_late, looked_at, turned):
    share = 1.0 - np.exp(-PERIOD / seconds) if seconds else 1.0
    filtered = [0.0]
    for change in np.diff(turned) / PERIOD:
        filtered.append(filtered[-1] + share * (change - filtered[-1]))
    found, mapping = looked_at(np.array(filtered)[20:], wheel_angle=turned[20:])
    assert (found is None) == is_late
    assert ("after the changes of wheel_angle, as a mean over several loops does" in mapping) == is_late


def test_a_rate_is_taken_where_there_is_no_time_or_too_little_of_it(tmp_path, turned):
    rate = (turned[20:] - turned[15:-5]) / (5 * PERIOD)
    for name, rows in (("time", 100), ("row", ROWS)):
        columns = np.column_stack([PERIOD * np.arange(ROWS), 0.05 * np.sin(np.arange(ROWS)), turned[20:], rate])[:rows]
        path = tmp_path / f"{name}.csv"
        path.write_text(text(columns, names=(name, "tilt", "wheel_angle", "wheel_speed [rad/s]")))
        assert yaml.safe_load(guess(path).mapping)["quantities"]["wheel_rate"] is not None
