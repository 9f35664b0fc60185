"""What is reachable on a robot at all: a search over regulators that know the truth.

Nothing here uses what learns (search, sysid, planar, models, policies): only the virtual robot and the rule by which
trials are judged. What no controller of the grid reaches is called unreachable; it is a bound from below, as a better
controller may still be there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import product
from math import degrees, hypot, inf
from typing import Any, NamedTuple

import numpy as np

from benchmarks.hidden_robots.pushes import FIRST_PUSH, PUSHES, Pushed, PushVerdict
from benchmarks.hidden_robots.reference_law import Compensation, Design, Law
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.core.evaluation import SuccessCriterion, judged
from twbal.core.plant import Pose
from twbal.core.robot_parameters import RobotParameters
from twbal.virtual_robot.ground_truth import GroundTruth
from twbal.virtual_robot.mujoco_robot import MujocoRobot

TRIALS = 5
FURTHER = 10
"""Controllers that are tried after the first that passes, for the quietest."""
_STICKY = 0.25

# The first of each are those that passed most often on robots of seeds 900-919, which no table shows.
_FRICTION = (
    Compensation(1.0, 1.0, 0.03, False),
    Compensation(1.0, 0.8, 0.03, True),
    Compensation(0.8, 0.5, 0.05, False),
    Compensation(1.0, 0.8, 0.15, False),
    Compensation(0.0, 0.0, 1.0, False),
)
_TORQUES = (0.3, 0.1, 1.0, 3.0)
_POSITIONS = (0.3, 1.0, 3.0)
_INTEGRALS = (10.0, 3.0, 1.0)
_DISTURBANCES = (0.05, None)


class Rules(NamedTuple):
    """Both rules of success."""

    default: SuccessCriterion
    sticky: SuccessCriterion


@dataclass(frozen=True)
class Reached:
    """What the reference search found on one robot.

    Attributes:
        reachable: whether a controller passes all trials by the rule that the robot is due.
        is_sticky: whether that is the sticky rule.
        tried: controllers, up to the first that passes.
        place: greatest distance from where it was put, of that with the least oscillation [m]; None: none passes.
        oscillation: of the tilt, peak to peak, the worst trial of the best controller [deg]; None: none passes.
        passes_default: whether a controller that was tried passes the default rule, too.
        design: the controller with the least oscillation.
    """

    reachable: bool
    is_sticky: bool
    tried: int
    place: float | None
    oscillation: float | None
    passes_default: bool
    design: Mapping[str, Any] | None


def is_sticky(truth: GroundTruth) -> bool:
    """Whether dead zone and dry friction of both wheels take more than a quarter of the torque limit."""
    gain = 0.5 * sum(truth.drive.gain)
    stuck = max(truth.drive.dead_zone) + 2.0 * truth.friction.coulomb / gain
    return stuck > _STICKY * truth.drive.torque_limit


def designs() -> list[Design]:
    """The grid, the likely ones first: by how far down the lists their parts stand, together."""
    lists = (_TORQUES, _POSITIONS, _INTEGRALS, _FRICTION, _DISTURBANCES)
    places = sorted(product(*(range(len(each)) for each in lists)), key=sum)
    return [
        Design(_TORQUES[t], _POSITIONS[p], _INTEGRALS[i], _FRICTION[f], _DISTURBANCES[d]) for t, p, i, f, d in places
    ]


def drive(robot: MujocoRobot, law: Law, trial: int, rule: SuccessCriterion) -> Episode:
    """One trial, which ends where it cannot succeed any more."""
    law.begin()
    seen, poses = [robot.reset(trial)], [robot.pose()]
    commands: list[float] = []
    lost = _Lost(rule)
    while len(commands) < rule.steps and not lost.by(len(commands), seen[-1].tilt, poses[-1], commands):
        commands.append(law.command(seen[-1]))
        seen.append(robot.step(commands[-1]))
        poses.append(robot.pose())
    observations = np.array(seen)
    return Episode(
        channels=("tilt",),
        control_period=robot.control_period,
        observations=observations,
        states=observations[:, 1:2],
        commands=np.array(commands),
        outcome=Outcome.COMPLETED if len(commands) == rule.steps else Outcome.STOPPED,
        provenance=Provenance("reference", "robot", trial=trial),
        poses=np.array(poses),
    )


def pushed(robot: MujocoRobot, design: Design, sheet: RobotParameters, rule: SuccessCriterion) -> list[PushVerdict]:
    """What becomes of ten pushes under a controller."""
    plant, found = Pushed(robot, sheet), []
    for trial in range(FIRST_PUSH, FIRST_PUSH + PUSHES):
        law = Law(robot.truth, design, robot.control_period)
        seen, poses, tilts = plant.reset(trial), [robot.pose()], [robot.pose().tilt]
        while len(tilts) <= plant.steps and abs(tilts[-1]) <= rule.tilt_limit:
            seen = plant.step(law.command(seen))
            poses.append(plant.pose())
            tilts.append(poses[-1].tilt)
        found.append(plant.verdict(tilts, poses, rule))
    return found


class _Lost:
    """Says when a trial has failed already, whatever comes."""

    def __init__(self, rule: SuccessCriterion) -> None:
        self._rule = rule
        self._changes = 0.0
        limit = inf if rule.command_change is None or rule.torque_limit is None else rule.command_change
        self._most = (limit * (rule.torque_limit or 1.0)) ** 2 * (rule.steps - rule.settle_step - 1)

    def by(self, step: int, tilt: float, pose: Pose, commands: Sequence[float]) -> bool:
        """Whether it is lost at this step, with these commands so far."""
        rule = self._rule
        if step >= rule.settle_step + 2:
            self._changes += (commands[-1] - commands[-2]) ** 2
        away = step >= rule.place_step and rule.place_limit is not None and hypot(pose.x, pose.y) > rule.place_limit
        leaning = step >= rule.settle_step and abs(tilt) >= rule.settled_tilt_limit
        return abs(tilt) > rule.tilt_limit or leaning or away or self._changes >= self._most


class Passed(NamedTuple):
    """A controller that passes all trials by one rule.

    Attributes:
        design: of it.
        place: the farthest of its trials [m].
        oscillation: the worst of them [rad].
        by_default: whether it passes the default rule too.
    """

    design: Design
    place: float
    oscillation: float
    by_default: bool


def tried_out(robot: MujocoRobot, design: Design, rules: Rules, sticky: bool, quieter_than: float) -> Passed | None:
    """Drive trials until one fails; None where one does, or oscillates by `quieter_than` [rad] or more."""
    try:
        law = Law(robot.truth, design, robot.control_period)
    except np.linalg.LinAlgError:  # no regulator with these weights
        return None
    rule = rules.sticky if sticky else rules.default
    places, oscillations, by_default = [], [], True
    for trial in range(TRIALS):
        episode = drive(robot, law, trial, rule)
        verdict = judged(episode, rule)
        if not verdict.succeeded or verdict.farthest is None or verdict.oscillation is None:
            return None
        if verdict.oscillation >= quieter_than:
            return None
        places.append(verdict.farthest)
        oscillations.append(verdict.oscillation)
        by_default = by_default and judged(episode, rules.default).succeeded
    return Passed(design, max(places), max(oscillations), by_default)


def search(robot: MujocoRobot, rules: Rules) -> Reached:
    """Try the grid until a controller passes all trials, and a few more for the quietest."""
    sticky, tried = is_sticky(robot.truth), 0
    passed: list[Passed] = []
    for number, design in enumerate(designs(), start=1):
        if passed and number > tried + FURTHER:
            break
        found = tried_out(robot, design, rules, sticky, passed[-1].oscillation if passed else inf)
        if found is not None:
            tried = tried or number
            passed.append(found)
    if not passed:
        return Reached(False, sticky, number, None, None, False, None)
    best = passed[-1]  # each is quieter than the one before
    return Reached(
        reachable=True,
        is_sticky=sticky,
        tried=tried,
        place=best.place,
        oscillation=degrees(best.oscillation),
        passes_default=any(each.by_default for each in passed),
        design=asdict(best.design),
    )
