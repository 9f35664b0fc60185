"""Of which robots a search knows: those of the sheet, and of rollouts as far as these tell anything."""

import numpy as np
import pytest

from twbal.algorithm.policy_search import PolicySearch
from twbal.core.channels import Channels
from twbal.core.cost import cost_over
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.core.evaluation import SuccessCriterion
from twbal.core.start_pose import StartPose
from twbal.models.dynamics import without_simulation
from twbal.policies.rbf import RbfPolicy
from twbal.search.robust import RobustSettings
from twbal.search.starts import PolicyParametrisation
from twbal.search.task import SearchSettings
from twbal.search.validation import Validation

PLACED = ("tilt", "tilt_rate", "speed", "command_1", "command_2", "position", "position_integral")
SUCCESS = SuccessCriterion(tilt_limit=0.5236, settled_tilt_limit=0.1745, settle_step=10, steps=20)
ROBUST = RobustSettings(
    robots=5,
    designs=1,
    screening=2,
    finalists=1,
    position_scales=(1.0,),
    change_scales=(1.0,),
    command_widths=(1.0,),
    compensations=(0.0,),
    improved=0,
    evaluations=4,
    improving=2,
    enough=0.0,
    doubt=1.0,
)
SEARCH = SearchSettings(
    horizon=6,
    short_horizon=3,
    iterations=1,
    short_iterations=1,
    restarts=1,
    long_horizon=6,
    long_iterations=0,
    min_success_rate=0.0,
    linearisation_amplitudes=(),
    lqr_command_widths=(),
    gain_scales=(),
    weight_penalty=1e-4,
    particles=0,
    tolerance=1e-5,
    degrees=(2, 4),
)


def find(robot, rollouts=(), names=PLACED, robust=ROBUST):
    """The result of a search on a model by which nothing changes, and what it said."""
    channels = Channels(names, robot.wheel_radius, robot.control_period)
    widths = {name: 1.0 for name in names if not name.startswith("command")}
    search = PolicySearch(
        channels=channels,
        start=StartPose(-0.17, 0.02, 0.05, 0.02),
        cost=cost_over(names, widths, 1.0, robot.torque_limit),
        shape=PolicyParametrisation(4, True, dict.fromkeys(widths, 0.5), command_scale=0.4, weight_sd=0.05),
        search=SEARCH,
        validation=Validation(robots=2, features=10, success=SUCCESS),
        robot=robot,
        robust=robust,
        seed=0,
        workers=1,
    )
    lines = []
    return search.find([without_simulation(channels)], (), None, rollouts, lines.append), lines


def falls_at_once(robot, steps):
    """A rollout that ended after so few steps, still within the tilts that tell something."""
    seen = np.zeros((steps + 1, 7))
    seen[:, 0] = robot.control_period * np.arange(steps + 1)
    seen[:, 1] = np.linspace(-0.2, -0.28, steps + 1)
    states, commands = np.zeros((steps + 1, len(PLACED))), np.full(steps, 3.0)
    told = Provenance("paper", "robot")
    return Episode(PLACED, robot.control_period, seen, states, commands, Outcome.TILT_LIMIT, told)


def same(one: RbfPolicy, other: RbfPolicy) -> bool:
    names = ("centres", "weights", "lengths", "gain", "compensation", "bias")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)


def test_rollouts_that_tell_nothing_leave_what_the_sheet_says(paper):
    """A robot that falls at once, again and again, does not end a run."""
    alone, _ = find(paper)
    found, lines = find(paper, [falls_at_once(paper, 3), falls_at_once(paper, 2)])
    assert same(found.best.policy, alone.best.policy)
    assert found.best.robots.rank == alone.best.robots.rank
    (line,) = [line for line in lines if line.startswith("the robot by")]
    assert line == ("the robot by its sheet alone: None of 2 episodes has 5 control periods of a robot that stands.")


def test_one_rollout_that_tells_something_is_enough(paper):
    alone, _ = find(paper)
    found, lines = find(paper, [falls_at_once(paper, 3), falls_at_once(paper, 12)])
    assert any(line.startswith("the robot by its rollouts: ") for line in lines)
    assert not any("by its sheet alone" in line for line in lines)
    assert found.best.robots.rank != alone.best.robots.rank


@pytest.mark.parametrize(
    ("names", "lacking"),
    [(("tilt", "tilt_rate", "acceleration"), "speed"), (("tilt", "acceleration"), "tilt_rate, speed")],
)
def test_a_state_that_no_regulator_can_take_is_searched_on_the_model_alone(paper, names, lacking):
    found, lines = find(paper, names=names)
    assert found.best.robots is None
    assert lines[0] == f"no robots of the parameter distribution (robust): the state has no {lacking}"
    _, quiet = find(paper, names=names, robust=None)
    assert lines[1:] == quiet
