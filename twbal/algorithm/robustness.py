"""Policies on virtual robots that are changed, step by step, from what they were learned on."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from twbal.algorithm.perturbations import UNITS, Axis, Perturbations
from twbal.algorithm.rollout import rollout
from twbal.algorithm.tested_robot import TestedRobot, perturbed_plant
from twbal.core.channels import Channels
from twbal.core.course import standing_targets
from twbal.core.episode import Provenance
from twbal.core.evaluation import SuccessCriterion, TrialVerdict, judged
from twbal.core.feed_forward import FeedForward
from twbal.core.plant import Plant
from twbal.core.robot_parameters import RobotParameters
from twbal.policies.policy import Policy
from twbal.virtual_robot.pushed_robot import PushedRobot

SUCCEEDED = "succeeded"
UPRIGHT = "upright"
PARTS = (UPRIGHT, "settled", "in_place", "quiet")
"""Of success; see `TrialVerdict`."""


class Cell(NamedTuple):
    """Trials of one policy at one level of one axis.

    Attributes:
        level: in the axis's unit; 0: the robot as it is.
        trials: driven.
        succeeded: of these, by the rule of success.
        upright, settled, in_place, quiet: of these, by a part of it; all where that is not asked.
    """

    level: float
    trials: int
    succeeded: int
    upright: int
    settled: int
    in_place: int
    quiet: int


class PolicyRobustness(NamedTuple):
    """One policy on the robot that it was learned on.

    Attributes:
        robot: name of its data sheet.
        seed: which virtual robot.
        unchanged: on the robot as it is.
        axes: by axis, one cell for each level.
    """

    robot: str
    seed: int
    unchanged: Cell
    axes: Mapping[str, tuple[Cell, ...]]


class MethodRobustness(NamedTuple):
    """The policies of one method, each on its robot. Shares are of trials, those of all robots together.

    Attributes:
        name: of the method.
        policies: of it.
    """

    name: str
    policies: tuple[PolicyRobustness, ...]

    def unchanged(self) -> float:
        """Share on the robots as they are."""
        return _share([policy.unchanged for policy in self.policies], SUCCEEDED)

    def shares(self, axis: str, part: str = SUCCEEDED) -> list[float]:
        """Share at each level of an axis.

        Args:
            axis: its name.
            part: that is counted, of `PARTS`; all that success asks by default. Of `mean` and `overall`, too.
        """
        return [_share(cells, part) for cells in zip(*(policy.axes[axis] for policy in self.policies), strict=True)]

    def mean(self, axis: str, part: str = SUCCEEDED) -> float:
        """Mean of that over the levels; the robots as they are do not count."""
        shares = self.shares(axis, part)
        return sum(shares) / len(shares)

    def overall(self, part: str = SUCCEEDED) -> float:
        """Mean of that over the axes."""
        means = [self.mean(axis, part) for axis in self.policies[0].axes]
        return sum(means) / len(means)

    @property
    def least(self) -> float:
        """The overall share of successes on the robot where that is least."""
        return min(MethodRobustness(self.name, (policy,)).overall() for policy in self.policies)


class AxisLevels(NamedTuple):
    """One axis.

    Attributes:
        name: of it.
        unit: of its levels.
        levels: increasing.
    """

    name: str
    unit: str
    levels: tuple[float, ...]


class Robustness(NamedTuple):
    """Methods beside each other.

    Attributes:
        seed: of the directions of model errors.
        trials: of each level on each robot.
        axes: in order.
        methods: in order.
    """

    seed: int
    trials: int
    axes: tuple[AxisLevels, ...]
    methods: tuple[MethodRobustness, ...]

    @property
    def on_same_robots(self) -> bool:
        """Whether all methods were tried on the same robots, as often."""
        robots = [sorted((policy.robot, policy.seed) for policy in method.policies) for method in self.methods]
        return all(each == robots[0] for each in robots)


def axes_of(perturbations: Perturbations) -> tuple[AxisLevels, ...]:
    """The axes as they are recorded."""
    return tuple(AxisLevels(axis, UNITS[axis], tuple(levels)) for axis, levels in perturbations.levels.items())


def trials_of(perturbations: Perturbations) -> int:
    """Trials that one policy drives on one robot."""
    return perturbations.trials * (1 + sum(map(len, perturbations.levels.values())))


def policy_robustness(
    policy: Policy,
    channels: Channels,
    robot: TestedRobot,
    perturbations: Perturbations,
    rule: SuccessCriterion,
    seed: int,
    driven: Callable[[], None] = lambda: None,
) -> PolicyRobustness:
    """Drive a robot by a policy, as it is and changed along each axis to each of its levels.

    Start poses and sensors' noise follow from the robot's seed and the trial, and directions of model errors from
    `seed`, too: all policies meet the same.

    Args:
        policy: it.
        channels: of the state that it reads.
        robot: as it is.
        perturbations: axes and levels.
        rule: by which trials are judged; after a push its times begin anew.
        seed: of the directions of model errors.
        driven: called after each trial.
    """

    def cell(axis: Axis | None, level: float) -> Cell:
        verdicts = []
        for number in range(perturbations.trials):
            trial = perturbations.first_trial + number
            plant = robot.plant() if axis is None else perturbed_plant(robot, axis, level, number, perturbations, seed)
            verdicts.append(trial_verdict(plant, policy, channels, robot.sheet, trial, rule))
            driven()
        return _cell(level, verdicts)

    axes = {str(axis): tuple(cell(axis, level) for level in levels) for axis, levels in perturbations.levels.items()}
    return PolicyRobustness(robot.sheet.name, robot.seed, cell(None, 0.0), axes)


def trial_verdict(
    plant: Plant, policy: Policy, channels: Channels, sheet: RobotParameters, trial: int, rule: SuccessCriterion
) -> TrialVerdict:
    """What becomes of one trial, driven as `twbal real-rollout` does by default.

    Where the robot is pushed, the rule's times begin anew at the end of the push.
    """
    asked = after(rule, plant.end) if isinstance(plant, PushedRobot) else rule
    with plant:
        episode = rollout(
            plant=plant,
            policy=policy,
            channels=channels,
            steps=asked.steps,
            tilt_limit=asked.tilt_limit,
            provenance=Provenance(sheet.name, "robot", trial=trial),
            targets=standing_targets(None, sheet, channels.names),
            feed_forward=FeedForward.of_robot(sheet),
        )
    return judged(episode, asked)


def after(rule: SuccessCriterion, step: int) -> SuccessCriterion:
    """The rule for what comes after a control period; before, the tilt limit alone holds."""
    return replace(
        rule,
        steps=rule.steps + step,
        settle_step=rule.settle_step + step,
        place_step=rule.place_step + step,
    )


def _cell(level: float, verdicts: Sequence[TrialVerdict]) -> Cell:
    parts = (sum(getattr(verdict, part) is not False for verdict in verdicts) for part in PARTS)
    return Cell(level, len(verdicts), sum(verdict.succeeded for verdict in verdicts), *parts)


def _share(cells: Sequence[Cell], part: str) -> float:
    return sum(int(getattr(cell, part)) for cell in cells) / sum(cell.trials for cell in cells)
