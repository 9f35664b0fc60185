"""For which robot's sheet a log was recorded."""

from collections.abc import Mapping
from typing import Any

import yaml

from twbal.core.episode import Provenance
from twbal.core.errors import ConfigError
from twbal.core.robot_parameters import RobotParameters
from twbal.core.robot_sheet import VALUES


def is_of_sheet(provenance: Provenance, sheet: str) -> bool:
    """Whether an episode is of the robot of a sheet.

    The robot on a link announces a name of its own, which is that of its firmware (`esp32`) and need not be that of the
    sheet (`my_robot`). Which sheet its rollout was recorded with stands in the recording stage's configuration.

    Args:
        provenance: of the episode.
        sheet: name of the sheet.
    """
    return provenance.robot == sheet or (provenance.source == "robot" and _configured(provenance.config) == sheet)


def robot_in_words(provenance: Provenance) -> str:
    """The name of an episode's robot in quotation marks, and of the sheet that it was recorded with if that differs."""
    sheet = _configured(provenance.config) if provenance.source == "robot" else None
    recorded = f", recorded with the sheet {sheet!r}" if sheet and sheet != provenance.robot else ""
    return f"{provenance.robot!r}{recorded}"


def recorded_robot(provenance: Provenance) -> RobotParameters | None:
    """The robot of the sheet that an episode was recorded with; None where its log says none that a robot can have."""
    said = _robot(provenance.config)
    values: dict[str, Any] = {name: said.get(name) for name in ("name", *VALUES)}
    try:
        return RobotParameters(**values) if isinstance(values["name"], str) else None
    except ConfigError:
        return None


def _configured(config: str) -> str | None:
    """The name of the robot's sheet in a configuration, as yaml text; None where it says none."""
    name = _robot(config).get("name")
    return name if isinstance(name, str) else None


def _robot(config: str) -> Mapping[str, Any]:
    """What a configuration, as yaml text, says of the robot; empty where it says nothing."""
    try:
        said = yaml.safe_load(config)
    except (yaml.YAMLError, ValueError, OverflowError, RecursionError):  # of a log that twbal did not write
        return {}
    robot = said.get("robot") if isinstance(said, dict) else None
    return robot if isinstance(robot, dict) else {}
