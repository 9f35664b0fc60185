"""A robot of its sheet in a yaml file that no configuration chose."""

from pathlib import Path

import yaml
from hydra.errors import HydraException
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from twbal.cli.composed import built
from twbal.cli.config_check import check_configuration
from twbal.cli.hydra_errors import explained, unreadable_yaml
from twbal.core.errors import ConfigError
from twbal.core.robot_parameters import RobotParameters

_ENDINGS = (".yaml", ".yml")
_STAGE = "lqr"  # by whose settings of the robot a sheet is checked


def is_robot_file(word: str | Path) -> bool:
    """Whether a robot is named by its file and not by the name of a packaged one."""
    return isinstance(word, Path) or "/" in word or word.endswith(_ENDINGS)


def robot_in(path: Path) -> RobotParameters:
    """The nominal parameters in a sheet, as `twbal new-robot` writes it or a person by hand.

    Raises:
        ConfigError: the file is not there or is no sheet, or a value cannot be right.
    """
    node = _read(path)
    if not isinstance(node, DictConfig):
        raise ConfigError(f"{path} is no robot sheet: it holds no values by name. Copy conf/robot/paper.yaml.")
    if "defaults" in node:
        raise ConfigError(
            f"The sheet {path} has the entry defaults, which only a configuration can follow. Write its values out."
        )
    cfg = OmegaConf.create({"robot": node})
    try:
        check_configuration(cfg, _STAGE)
        found = built(cfg, "robot")
    except ConfigError as error:
        raise ConfigError(f"The sheet {path} cannot be used. {error}") from error
    except (HydraException, OmegaConfBaseException) as error:
        raise ConfigError(f"The sheet {path} cannot be used. {explained(error, _STAGE)}") from error
    if not isinstance(found, RobotParameters):
        raise ConfigError(f"{path} is no robot sheet: it makes a {type(found).__name__}. Copy conf/robot/paper.yaml.")
    return found


def _read(path: Path) -> object:
    try:
        return OmegaConf.load(path)
    except FileNotFoundError as error:
        raise ConfigError(
            f"There is no robot sheet {path}. Give the name of a packaged robot, such as 'paper', or the path of a "
            "sheet, such as 'my_conf/robot/my_robot.yaml'; `twbal new-robot` writes one."
        ) from error
    except OSError as error:
        raise ConfigError(f"The robot sheet {path} cannot be read: {error.strerror or error}.") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise unreadable_yaml(error) from error
