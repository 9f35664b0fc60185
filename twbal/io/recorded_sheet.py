"""For which robot's sheet a log was recorded."""

import yaml

from twbal.core.episode import Provenance


def is_of_sheet(provenance: Provenance, sheet: str) -> bool:
    """Whether an episode is of the robot of a sheet.

    The robot on a link announces a name of its own, which is that of its firmware (`esp32`) and need not be that of the
    sheet (`my_robot`). Which sheet its rollout was recorded with stands in the recording stage's configuration.

    Args:
        provenance: of the episode.
        sheet: name of the sheet.
    """
    return provenance.robot == sheet or (provenance.source == "robot" and _configured(provenance.config) == sheet)


def told_robot(provenance: Provenance) -> str:
    """The name of an episode's robot in quotation marks, and of the sheet that it was recorded with if that differs."""
    sheet = _configured(provenance.config) if provenance.source == "robot" else None
    recorded = f", recorded with the sheet {sheet!r}" if sheet and sheet != provenance.robot else ""
    return f"{provenance.robot!r}{recorded}"


def _configured(config: str) -> str | None:
    """The name of the robot's sheet in a configuration, as yaml text; None where it says none."""
    try:
        said = yaml.safe_load(config)
    except (yaml.YAMLError, ValueError, OverflowError, RecursionError):  # of a log that twbal did not write
        return None
    robot = said.get("robot") if isinstance(said, dict) else None
    name = robot.get("name") if isinstance(robot, dict) else None
    return name if isinstance(name, str) else None
