"""The rules of success that can be chosen, as each robot gets them."""

import numpy as np
import pytest
from hydra import compose
from hydra.utils import instantiate

from twbal.cli.composition import composing

ROBOTS = {"paper": (0.02, 0.15, 20.0), "regbot": (0.015, 0.03, 0.49)}


def rule(*words):
    with composing():
        return instantiate(compose("iterate", list(words)).success)


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize(("choice", "radii", "change"), [("default", 1.0, 0.1), ("sticky", 2.0, 0.15)])
def test_times_are_those_of_the_robots_control_period(robot, choice, radii, change):
    period, radius, limit = ROBOTS[robot]
    found = rule(f"robot={robot}", f"success={choice}")
    for steps, seconds in ((found.steps, 10.0), (found.settle_step, 2.0), (found.place_step, 5.0)):
        assert seconds - 1e-9 <= steps * period < seconds + period
    assert (found.place_radii, found.command_change, found.torque_limit) == (radii, change, limit)
    assert found.wheel_radius == pytest.approx(radius)
    assert np.degrees([found.tilt_limit, found.settled_tilt_limit]) == pytest.approx([30.0, 10.0], abs=1e-3)


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("word", ["experiment=paper", "success=paper"])
def test_the_papers_rule_is_thirty_degrees_for_a_hundred_control_periods_and_nothing_else(robot, word):
    found = rule(f"robot={robot}", word)
    assert (found.steps, found.place_radii, found.command_change) == (100, None, None)
    assert found.settled_tilt_limit == found.tilt_limit == pytest.approx(np.radians(30.0), abs=1e-5)


def test_validation_is_by_the_same_rule():
    with composing():
        cfg = compose("iterate", ["success=sticky", "success.duration=7"])
    assert instantiate(cfg.validation).success == instantiate(cfg.success)
