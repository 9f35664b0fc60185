"""What a live view gives to Rerun, read back from the recording by Rerun's own program."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from twbal.core.robot_parameters import RobotParameters
from twbal.viz.live.sample import Sample
from twbal.viz.live.view import LiveView, view_command

pytest.importorskip("rerun", reason="comes with the extra [viewers]")
RERUN = shutil.which("rerun") or str(Path(sys.executable).with_name("rerun"))
ROBOT = RobotParameters("cart", 5.0, 0.25, 0.0, 0.1, 0.1, 0.05, 0.5, 0.1, 0.003, 0.03, 0.4, 10.0, 0.02)


def printed(path, entity):
    command = [RERUN, "rrd", "print", "-vvv", "--entity", f"/{entity}", str(path)]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def rows(path, entity, numbers):
    """Times [s] and values of an entity, (N, 1 + numbers), of rows with so many numbers in their last cell."""
    pattern = r"┆ PT?([\d.]+)[SD] +┆ (?:.*┆ )?\[+([-\d., e]+)\]+ +│"  # P0D, PT0.02S
    found = [(time, values.split(",")) for time, values in re.findall(pattern, printed(path, entity))]
    made = sorted([float(time), *map(float, values)] for time, values in found if len(values) == numbers)
    return np.array(made)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """A drive ahead by 1 m, a turn to the left by 90° on the spot, and 0.5 m ahead; leaning by 0.1 rad."""
    path = tmp_path_factory.mktemp("view") / "drive.rrd"
    share = np.linspace(0.0, 1.0, 51)
    place = np.concatenate([share, np.ones(50), 1.0 + 0.5 * share[1:]])
    heading = np.concatenate([np.zeros(51), 0.5 * np.pi * share[1:], np.full(50, 0.5 * np.pi)])
    with LiveView(view_command(ROBOT, path)) as view:
        for k, (at, looks) in enumerate(zip(place, heading, strict=True)):
            view.show(Sample(0.02 * k, 0.1, at / 0.1, at, at + 0.25, 0.5, 0.4, 0.3, looks, looks, 2.0))
        assert view.close() is None
    return path, place, heading


def test_a_recording_is_whole_and_has_each_quantity_at_its_time(recording):
    path, place, heading = recording
    verified = subprocess.run([RERUN, "rrd", "verify", str(path)], capture_output=True, text=True)
    assert verified.returncode == 0, verified.stderr
    times = 0.02 * np.arange(len(place))
    expected = {
        "tilt/robot": np.full(len(place), np.degrees(0.1)),
        "place/robot": place,
        "place/reference": place + 0.25,
        "speed/robot": np.full(len(place), 0.5),
        "speed/reference": np.full(len(place), 0.4),
        "speed/asked": np.full(len(place), 0.3),
        "heading/robot": np.degrees(heading),
        "command/command": np.full(len(place), 2.0),
    }
    for name, values in expected.items():
        assert rows(path, f"plots/{name}", 1) == pytest.approx(np.column_stack([times, values]), abs=1e-6), name


def test_the_robot_is_in_space_where_place_and_heading_say_it_is(recording):
    path, place, _ = recording
    shown = printed(path, "world/robot")
    translations = np.array(re.findall(r"\[\[([-\d.e]+), ([-\d.e]+), ([-\d.e]+)\]\]", shown), dtype=float)
    assert len(translations) == len(place)
    assert translations[50] == pytest.approx([1.0, 0.0, 0.1], abs=1e-5)
    assert translations[-1] == pytest.approx([1.0, 0.5, 0.1], abs=1e-5)
    half = 0.05
    leans = rows(path, "world/robot/body", 4)[:, 1:]
    assert leans == pytest.approx(np.tile([0.0, np.sin(half), 0.0, np.cos(half)], (len(place), 1)), abs=1e-6)


def test_wheels_turn_apart_where_the_robot_turns(recording):
    path, _, _ = recording
    left, right = (rows(path, f"world/robot/{side}_wheel/turned", 4) for side in ("left", "right"))
    angle = [2.0 * np.arctan2(each[75, 2], each[75, 4]) for each in (left, right)]
    expected = np.array([10.0 - 0.5 * 0.4 / 0.1 * np.pi / 4, 10.0 + 0.5 * 0.4 / 0.1 * np.pi / 4])
    assert np.cos(np.array(angle) - expected) == pytest.approx([1.0, 1.0], abs=1e-6)


def test_a_robot_whose_heading_nobody_knows_drives_straight_and_has_no_plot_of_it(tmp_path):
    path, nan = tmp_path / "drive.rrd", float("nan")
    with LiveView(view_command(ROBOT, path)) as view:
        for k in range(10):
            view.show(Sample(0.02 * k, 0.0, 0.1 * k, 0.01 * k, 0.0, 0.5, 0.0, nan, nan, nan, 0.0))
        assert view.close() is None
    assert rows(path, "plots/heading/robot", 1).size == 0 and rows(path, "plots/speed/asked", 1).size == 0
    assert "nan" not in printed(path, "world/robot").lower()


def test_a_recording_that_cannot_be_written_is_an_error_before_the_drive(tmp_path):
    with pytest.raises(Exception, match="did not start"):
        LiveView(view_command(ROBOT, tmp_path / "nowhere" / "drive.rrd"))


def test_the_shape_of_a_robot_is_told_by_its_sheet():
    shape = json.loads(view_command(ROBOT, "file")[3])
    assert shape == {"name": "cart", "wheel_radius": 0.1, "wheel_width": 0.03, "track": 0.4, "com_height": 0.25}
