"""Which robot a policy was made for, by its file and by the manifest of the run folder in which it lies."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import yaml

from twbal.cli.composition import loaded_text
from twbal.cli.console import say
from twbal.cli.manifest import read_manifest
from twbal.cli.policy_check import check_made_for
from twbal.core.errors import DataError
from twbal.core.files import file_hash
from twbal.core.robot_parameters import RobotParameters
from twbal.policies.policy import Policy
from twbal.policies.saved import SavedPolicy

_SAME_RADIUS = 0.01  # share by which the radius of a robot's wheels may differ from that of the policy's robot


def say_doubts_of_policy(policy: Policy, files: Iterable[Path], robot: RobotParameters) -> None:
    """Warn of what speaks against a policy being made for the robot that it is to drive.

    Args:
        policy: that is to drive.
        files: its checkpoint; none where it is of no file.
        robot: its sheet.

    Raises:
        ConfigError: it was made for another control period.
    """
    for file in files:
        if isinstance(policy, SavedPolicy):
            policy = with_control_period(policy, file)
        for doubt in _other_robot(file, robot):
            say(f"WARNING: {doubt}")
    for doubt in check_made_for(policy, robot):
        say(f"WARNING: {doubt}")


def with_control_period(policy: SavedPolicy, file: Path) -> SavedPolicy:
    """The same policy, with the control period that it was made for, if its file does not tell it and its folder does.

    Args:
        policy: of a checkpoint.
        file: the checkpoint.
    """
    return policy if policy.control_period is not None else replace(policy, control_period=_period_beside(file))


def _other_robot(file: Path, robot: RobotParameters) -> list[str]:
    """A sentence on a policy that was made for a robot of another name, or with wheels of another radius.

    Its place and its speed come from the wheels' angles by the radius.
    """
    made_for = _robot_beside(file)
    name, radius = made_for.get("name", robot.name), made_for.get("wheel_radius", robot.wheel_radius)
    is_same_size = isinstance(radius, float) and abs(radius - robot.wheel_radius) <= _SAME_RADIUS * robot.wheel_radius
    if name == robot.name and is_same_size:
        return []
    return [
        f"The policy {file} was made for the robot {name!r}, with a wheel radius of {radius} m. The robot of this "
        f"command is {robot.name!r}, with {robot.wheel_radius:g} m. Choose the other one by robot=..., if that is meant"
    ]


def _period_beside(file: Path) -> float | None:
    """Control period of the robot in the settings of the run folder that made a file [s]; None: not told."""
    period = _robot_beside(file).get("control_period")
    return period if isinstance(period, float) and period > 0.0 else None


def _robot_beside(file: Path) -> dict[str, Any]:
    """The robot in the settings of the run folder that made a file; empty where these do not tell."""
    try:
        manifest = read_manifest(file.parent)
        if manifest is None or (file.name, file_hash(file)) not in ((o.path, o.sha256) for o in manifest.outputs):
            return {}
        settings = loaded_text(manifest.settings)
    except (DataError, yaml.YAMLError):  # of another version of twbal
        return {}
    robot = settings.get("robot") if isinstance(settings, dict) else None
    return robot if isinstance(robot, dict) else {}
