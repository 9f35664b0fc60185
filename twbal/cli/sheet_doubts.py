"""What is doubted of the robot's sheet, and of the simulation with it, before a command begins."""

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.cli.sim_files import doubts_of_simulation
from twbal.core.robot_parameters import RobotParameters
from twbal.sheets.doubts import doubts


def doubts_of(cfg: DictConfig) -> list[str]:
    """A sentence on each value of the robot that is hardly right, and on a simulation that was made for another one.

    None where a stage has no robot.

    Args:
        cfg: of a stage, checked.
    """
    robot = instantiate(cfg.robot) if cfg.get("robot") else None
    if not isinstance(robot, RobotParameters):
        return []
    return [*doubts(robot), *(doubts_of_simulation(robot.name) if cfg.get("sim") else [])]
