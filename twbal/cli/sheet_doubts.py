"""What is doubted of the robot's sheet, and of the simulation with it, before a command begins."""

from pathlib import PurePosixPath

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.cli.sim_files import doubts_of_simulation
from twbal.core.robot_parameters import RobotParameters
from twbal.sheets.doubts import doubts


def doubts_of(cfg: DictConfig, sheet: str | None = None) -> list[str]:
    """A sentence on each value of the robot that is hardly right, and on a simulation that was made for another one.

    None where a stage has no robot.

    Args:
        cfg: of a stage, checked.
        sheet: that was chosen on a command line, by the name of its file; None: by none, or with another `robot.name`.
    """
    robot = instantiate(cfg.robot) if cfg.get("robot") else None
    if not isinstance(robot, RobotParameters):
        return []
    return [*_of_name(robot.name, sheet), *doubts(robot), *(doubts_of_simulation(robot.name) if cfg.get("sim") else [])]


def _of_name(name: str, sheet: str | None) -> list[str]:
    """A sentence on a sheet that has the name of another robot, such as that from which it was copied."""
    file = PurePosixPath(sheet or name).name
    if file == name:
        return []
    return [
        f"the sheet of robot={file} has name: {name}, with which its episodes are marked. If it was copied from that "
        f"robot's sheet, write name: {file} into it"
    ]
