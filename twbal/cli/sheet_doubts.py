"""What is doubted of the robot's sheet before a command begins."""

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.core.robot_parameters import RobotParameters
from twbal.sheets.doubts import doubts


def doubts_of(cfg: DictConfig) -> list[str]:
    """A sentence on each value of the robot that is hardly right; none where a stage has no robot.

    Args:
        cfg: of a stage, checked.
    """
    robot = instantiate(cfg.robot) if cfg.get("robot") else None
    return doubts(robot) if isinstance(robot, RobotParameters) else []
