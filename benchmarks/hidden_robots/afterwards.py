"""What the last policy does beyond the trials: it stands a minute, and is pushed."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import ceil
from pathlib import Path
from typing import Any

from benchmarks.hidden_robots.pushes import FIRST_PUSH, PUSHES, Pushed
from benchmarks.hidden_robots.record import trial_record
from benchmarks.hidden_robots.reference import Rules
from benchmarks.hidden_robots.robots import run
from twbal.algorithm.rollout import rollout
from twbal.cli.artefacts import read_logs
from twbal.core.channels import Channels
from twbal.core.course import standing_targets
from twbal.core.episode import Provenance
from twbal.core.evaluation import SuccessCriterion
from twbal.core.feed_forward import FeedForward
from twbal.core.plant import Pose
from twbal.core.robot_parameters import RobotParameters
from twbal.policies.policy import Policy
from twbal.virtual_robot.mujoco_robot import MujocoRobot

MINUTE = 60.0  # [s]
MINUTES = 5


def stand_a_minute(
    folder: Path, policy: Path, words: Sequence[str], robot: RobotParameters, rules: Rules
) -> list[dict[str, Any]]:
    """Records of trials of a minute with `policy`, driven by `twbal real-rollout` with these settings."""
    steps = ceil(MINUTE / robot.control_period - 1e-9)
    given = [f"policy.path={policy}", f"steps={steps}", f"trials={MINUTES}", f"first_trial={FIRST_PUSH}", *words]
    run("real-rollout", folder, given)
    longer = Rules(*(replace(rule, steps=steps) for rule in rules))
    return [trial_record(episode, longer) for episode in read_logs([folder])]


def push(
    robot: MujocoRobot, policy: Policy, channels: Channels, sheet: RobotParameters, rule: SuccessCriterion, yields: bool
) -> list[dict[str, bool]]:
    """Whether each of ten pushes is survived, and whether the robot is back in place in time and stays there.

    Args:
        robot: that is pushed.
        policy: that drives it.
        channels: of the state.
        sheet: its data sheet.
        rule: of success.
        yields: whether it yields to pushes (`yield_to_pushes` of `twbal real-rollout`).
    """
    plant, found = Pushed(robot, sheet), []
    targets = standing_targets(yields, sheet, channels.names)
    drive = partial(rollout, plant, policy, channels, plant.steps, rule.tilt_limit, targets=targets)
    for trial in range(FIRST_PUSH, FIRST_PUSH + PUSHES):
        provenance = Provenance(sheet.name, "robot", trial=trial)
        episode = drive(provenance, feed_forward=FeedForward.of_robot(sheet))
        assert episode.poses is not None
        poses = [Pose(*pose) for pose in episode.poses.tolist()]
        found.append(plant.verdict(episode.tilt.tolist(), poses, rule)._asdict())
    return found
