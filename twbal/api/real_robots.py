"""What the commands do for a robot on a link before and while they drive it, for the functions of the library."""

from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from twbal.api.sheets import RobotLike, is_packaged
from twbal.cli.composed import warn_of
from twbal.cli.link_gate import advice_of_last_check
from twbal.cli.signals import stopped_once
from twbal.core.plant import Plant
from twbal.core.robot_parameters import RobotParameters
from twbal.link.serial_plant import SerialPlant
from twbal.sheets.writing import is_of_interview


def heed_last_check(plant: SerialPlant, sheet: RobotParameters, robot: RobotLike) -> None:
    """Refuse a robot whose last `twbal check-link` speaks against arming it; it is closed then.

    Args:
        plant: the robot.
        sheet: its parameters.
        robot: as it was given.

    Raises:
        CheckError: it is not to be armed.

    Warns:
        UserWarning: the robot, or a part of it, was never tried.
    """
    try:
        advice = advice_of_last_check(plant, sheet, _is_of_interview(robot), "twbal.connect(..., heed_check=False)")
    except BaseException:
        plant.close()
        raise
    warn_of([f"{advice[0].upper()}{advice[1:]}."] if advice else [])


def stoppable(plant: Plant) -> AbstractContextManager[None]:
    """On a robot on a link, let the first Ctrl-C, SIGTERM or closed terminal stop it, as `stopped_once` does."""
    return stopped_once() if isinstance(plant, SerialPlant) else nullcontext()


def _is_of_interview(robot: RobotLike) -> bool:
    """Whether a robot is given by the path of a sheet that `twbal new-robot` made."""
    if isinstance(robot, RobotParameters) or is_packaged(robot):
        return False
    return is_of_interview(Path(robot).read_text(encoding="utf-8"))
