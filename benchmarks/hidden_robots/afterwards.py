"""What the last policy does beyond the trials: it stands a minute, and is pushed."""

from collections.abc import Sequence
from dataclasses import replace
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.hidden_robots.record import trial_record
from benchmarks.hidden_robots.reference import Rules
from benchmarks.hidden_robots.robots import run
from twbal.algorithm.rollout import rollout
from twbal.cli.artefacts import read_logs
from twbal.core.channels import Channels
from twbal.core.episode import Episode, Provenance
from twbal.core.evaluation import SuccessCriterion
from twbal.core.plant import Observation, Plant, Pose
from twbal.core.robot_parameters import RobotParameters
from twbal.policies.policy import Policy
from twbal.virtual_robot.mujoco_robot import MujocoRobot

MINUTE = 60.0  # [s]
MINUTES = 5
PUSHES = 10
_FIRST = 1000  # number of their first trial; those before were driven to learn or to decide
_PUSH_TIME, _PUSH_DURATION, _TIME_AFTER = 5.0, 0.1, 10.0  # [s]
_BACK = 5.0  # after a push, in which it must be back in place [s]
_IMPULSE = 10.0 / 10.0  # over the mass of the data sheet's body [N·s/kg]


def stand_a_minute(
    folder: Path, policy: Path, words: Sequence[str], robot: RobotParameters, rules: Rules
) -> list[dict[str, Any]]:
    """Records of trials of a minute with `policy`, driven by `twbal real-rollout` with these settings."""
    steps = ceil(MINUTE / robot.control_period - 1e-9)
    given = [f"policy.path={policy}", f"steps={steps}", f"trials={MINUTES}", f"first_trial={_FIRST}", *words]
    run("real-rollout", folder, given)
    longer = Rules(*(replace(rule, steps=steps) for rule in rules))
    return [trial_record(episode, longer) for episode in read_logs([folder])]


class Pushed(Plant):
    """A robot that is pushed once in each rollout.

    Args:
        robot: it.
        impulse: of the push, forward [N·s]; every other trial is pushed backward.
    """

    def __init__(self, robot: MujocoRobot, impulse: float) -> None:
        self.control_period = robot.control_period
        self._robot, self._period = robot, 0
        self.begin = ceil(_PUSH_TIME / robot.control_period - 1e-9)
        self._end = self.begin + max(round(_PUSH_DURATION / robot.control_period), 1)
        self._force = impulse / ((self._end - self.begin) * robot.control_period)
        self._sign = 1.0

    def reset(self, trial: int) -> Observation:
        """Begin the rollout."""
        self._period, self._sign = 0, -1.0 if trial % 2 else 1.0
        return self._robot.reset(trial)

    def step(self, command: float) -> Observation:
        """Drive one control period, pushed or not."""
        is_pushed = self.begin <= self._period < self._end
        self._robot.push = self._sign * self._force if is_pushed else 0.0
        self._period += 1
        return self._robot.step(command)

    def pose(self) -> Pose | None:
        """The true one."""
        return self._robot.pose()

    def stop(self) -> None:
        """See the robot's."""
        self._robot.stop()

    def close(self) -> None:
        """See the robot's."""
        self._robot.close()


def push(
    robot: MujocoRobot, policy: Policy, channels: Channels, sheet: RobotParameters, rule: SuccessCriterion
) -> list[dict[str, bool]]:
    """Whether each of ten pushes is survived, and whether the robot is back in place in time and stays there."""
    plant = Pushed(robot, _IMPULSE * sheet.body_mass)
    steps = plant.begin + ceil((_PUSH_DURATION + _TIME_AFTER) / robot.control_period)
    late = ceil((_PUSH_TIME + _PUSH_DURATION + _BACK) / robot.control_period - 1e-9)
    found = []
    for trial in range(_FIRST, _FIRST + PUSHES):
        provenance = Provenance(sheet.name, "robot", trial=trial)
        episode = rollout(plant, policy, channels, steps, rule.tilt_limit, provenance)
        survived = len(episode) == steps and bool(np.abs(episode.tilt).max() <= rule.tilt_limit)
        found.append({"survived": survived, "back": survived and _away(episode, late) <= (rule.place_limit or np.inf)})
    return found


def _away(episode: Episode, late: int) -> float:
    """Greatest distance from where it was put, from a sample on [m]."""
    assert episode.poses is not None
    return float(np.hypot(*episode.poses[late:, :2].T).max())
