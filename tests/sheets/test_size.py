"""Which numbers of a robot are believed."""

import pytest
from hydra import compose
from hydra.utils import instantiate

from twbal.cli.composition import composing
from twbal.cli.conf_folder import conf_folder
from twbal.sheets.questions import QUESTIONS
from twbal.sheets.size import believed_range

QUESTION = QUESTIONS["wheel_inertia"]
KNOWN = {"body_mass": 1.09, "wheel_mass": 0.05, "wheel_radius": 0.04}


@pytest.mark.parametrize(("inertia", "believed"), [(4e-5, True), (9e-4, True), (0.73, False), (0.1, False)])
def test_a_wheel_is_not_harder_to_turn_than_the_whole_robot_is_heavy(inertia, believed):
    known = believed_range(QUESTION, KNOWN)
    assert (known.low <= inertia <= known.high) is believed


def test_without_masses_the_range_is_that_of_all_robots():
    assert believed_range(QUESTION, {}).high == QUESTION.high


@pytest.mark.parametrize("key", ["track", "com_height"])
@pytest.mark.parametrize(("length", "believed"), [(0.05, True), (0.3, True), (1.5, False)])
def test_a_robot_is_not_many_times_as_large_as_its_wheels(key, length, believed):
    known = believed_range(QUESTIONS[key], {"wheel_radius": 0.04})
    assert (known.low <= length <= known.high) is believed


@pytest.mark.parametrize(("mass", "believed"), [(1.09, True), (0.1, False)])
def test_a_body_is_not_lighter_than_its_wheels(mass, believed):
    known = believed_range(QUESTIONS["body_mass"], {"wheel_mass": 1.09 / 2})
    assert (known.low <= mass <= known.high) is believed


def test_packaged_robots_are_believed():
    for name in (file.stem for file in (conf_folder() / "robot").glob("*.yaml")):
        with composing():
            robot = instantiate(compose("sim_collect", [f"robot={name}"]).robot)
        known = {key: getattr(robot, key) for key in ("wheel_mass", "wheel_radius", "body_mass")}
        for key in ("track", "com_height", "body_mass", "torque_limit", "wheel_inertia"):
            expected = believed_range(QUESTIONS[key], known)
            assert expected.low <= getattr(robot, key) <= expected.high, (name, key)
