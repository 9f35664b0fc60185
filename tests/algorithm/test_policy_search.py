"""Of which robots a search knows: those of the sheet, or of a distribution that rollouts made."""

import numpy as np
import pytest
from falling import PLACED, falls_at_once

from twbal.algorithm.identification import identify
from twbal.algorithm.policy_search import PolicySearch
from twbal.core.channels import Channels
from twbal.core.cost import cost_over
from twbal.core.evaluation import SuccessCriterion
from twbal.core.start_pose import StartPose
from twbal.models.dynamics import without_simulation
from twbal.planar.robot_distribution import prior_of
from twbal.policies.rbf import RbfPolicy
from twbal.search.robust import RobustSettings
from twbal.search.starts import PolicyParametrisation
from twbal.search.task import SearchSettings
from twbal.search.validation import Validation

SUCCESS = SuccessCriterion(tilt_limit=0.5236, settled_tilt_limit=0.1745, settle_step=10, steps=20)
ROBUST = RobustSettings(
    robots=5,
    designs=1,
    screening=2,
    finalists=1,
    width_scales={},
    position_scales=(1.0,),
    change_scales=(1.0,),
    command_widths=(1.0,),
    compensations=(0.0,),
    compensation_tilt=0.015,
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


def find(robot, known=None, names=PLACED, robust=ROBUST, earlier=()):
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
    return search.find([without_simulation(channels)], earlier, None, known, lines.append), lines


def same(one: RbfPolicy, other: RbfPolicy) -> bool:
    names = ("centres", "weights", "lengths", "gain", "compensation", "bias")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)


def test_without_anything_known_the_sheet_tells_of_the_robots(paper):
    alone, _ = find(paper)
    found, _ = find(paper, prior_of(paper))
    assert same(found.best.policy, alone.best.policy)
    assert found.best.robots.rank == alone.best.robots.rank


def test_what_is_known_decides_for_which_robots_is_searched(paper):
    alone, _ = find(paper)
    found, _ = find(paper, identify(paper, [falls_at_once(paper, 12)], lambda line: None).known)
    assert found.best.robots.rank != alone.best.robots.rank


def test_regulators_are_sought_anew_only_where_rollouts_tell_of_other_robots(paper):
    first, _ = find(paper)
    (regulator,) = [c.origin for c in first.candidates if c.origin.startswith("regulator of robot")]
    by_sheet, _ = find(paper, earlier=[first.best.policy])
    assert {c.origin for c in by_sheet.candidates} == {"policy 0", "search from policy 0"}
    known = identify(paper, [falls_at_once(paper, 12)], lambda line: None).known
    by_rollouts, _ = find(paper, known, earlier=[first.best.policy])
    assert {c.origin for c in by_rollouts.candidates} == {"policy 0", regulator, f"search from {regulator}"}


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
