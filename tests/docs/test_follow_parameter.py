"""The script that follows a parameter, on a package whose walk is known, and on twbal."""

import sys
from itertools import pairwise
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MOST_MODULES, MOST_RETURNS = 10, 2
PARAMETERS = ("torque_limit", "tilt_limit", "Channels", "Episode", "diagnosis.settings")
SMALL = {
    "core/robot.py": """
from dataclasses import dataclass
@dataclass
class Robot:
    name: str
    limit: float
""",
    "core/clip.py": """
def clip(value: float, most: float) -> float:
    return min(value, most)
""",
    "plant/motor.py": """
from small.core.clip import clip
from small.core.robot import Robot
class Motor:
    def __init__(self, robot: Robot) -> None:
        self.robot = robot
    def drive(self, command: float) -> float:
        return clip(command, self.robot.limit)
""",
    "plant/untouched.py": """
from small.core.robot import Robot
from small.plant.motor import Motor
def build(robot: Robot) -> Motor:
    return Motor(robot)
""",
    "cli/stages/go.py": """
from small.core.robot import Robot
from small.plant.untouched import build
def run(cfg: DictConfig) -> None:
    robot: Robot = instantiate(cfg.robot)
    motor = build(robot)
    motor.drive(2 * robot.limit)
    print(robot.limit)
""",
}


@pytest.fixture(scope="module")
def follow():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "scripts"))
        for name in [name for name in sys.modules if name.startswith("parameter_walk")]:
            patch.delitem(sys.modules, name)
        from parameter_walk import code, picture, walk

        yield code, walk, picture


@pytest.fixture(scope="module")
def package(follow):
    return follow[0].Code(ROOT / "twbal")


@pytest.fixture
def small(follow, tmp_path):
    for place, text in SMALL.items():
        path = tmp_path / "small" / place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return follow[0].Code(tmp_path / "small")


def test_stops_are_where_a_value_is_read_or_handed_on_under_any_name(follow, small):
    """By hand: read for the call, handed to `clip` as `most`, which reads it, and read once more."""
    (found,) = follow[1].walks(small, "limit").values()
    assert [stop.module for stop in found.stops] == [
        *("cli/stages/go.py", "plant/motor.py", "core/clip.py", "cli/stages/go.py")
    ]
    assert found.returns({"core": 0, "plant": 1, "cli": 2}) == 1


def test_an_object_is_followed_where_it_goes_untouched_too(follow, small):
    (found,) = follow[1].walks(small, "Robot").values()
    assert found.modules == ["cli/stages/go.py", "plant/untouched.py", "plant/motor.py"]


def test_a_parameter_that_there_is_not_goes_nowhere(follow, small):
    assert follow[1].walks(small, "radius") == {}


@pytest.mark.parametrize("what", PARAMETERS)
def test_a_parameter_travels_a_short_way(follow, package, what):
    code, walk, _ = follow
    layers = code.layers(ROOT)
    found = walk.walks(package, what)
    assert found
    assert {name: each.modules for name, each in found.items() if len(each.modules) > MOST_MODULES} == {}
    returns = {name: each.returns(layers) for name, each in found.items()}
    assert {name: count for name, count in returns.items() if count > MOST_RETURNS} == {}


def test_the_picture_has_each_folder_and_each_parameter(follow, package):
    code, _, picture = follow
    layers = code.layers(ROOT)
    drawn = picture.picture(package, layers, dict(zip(PARAMETERS, PARAMETERS, strict=True)))
    written = (ROOT / "docs" / "pictures" / "architecture.svg").read_text()
    for folder in layers:
        assert f">{folder}</text>" in drawn
        assert f">{folder}</text>" in written, "Run `python scripts/follow_parameter.py --draw`."


def test_no_line_of_the_picture_runs_through_words_and_arrows_say_which_way_a_parameter_goes(follow, package):
    code, _, picture = follow
    drawn = picture.picture(package, code.layers(ROOT), {what: what for what in PARAMETERS})
    lines = drawn.splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("<text"))
    assert lines[-1] == "</svg>"
    assert all(line.startswith("<text") for line in lines[first:-1])
    assert all('paint-order="stroke"' in line for line in lines[first:-1])
    for i, what in enumerate(PARAMETERS):
        _, route = picture._route(package, what)
        ways = set(pairwise(folder for folder in route if folder in code.layers(ROOT)))
        arrows = [line for line in lines if line.startswith("<path") and picture._COLOURS[i] in line]
        assert len(arrows) == len(ways) + 1  # one in the key


def test_an_arrow_points_to_where_a_way_ends(follow):
    picture = follow[2]
    assert "translate(62.0,0.0) rotate(0.0)" in picture._arrow((0.0, 0.0), (100.0, 0.0), "red")
    assert "translate(0.0,62.0) rotate(90.0)" in picture._arrow((0.0, 0.0), (0.0, 100.0), "red")
    assert "translate(0.0,38.0) rotate(-90.0)" in picture._arrow((0.0, 100.0), (0.0, 0.0), "red")
