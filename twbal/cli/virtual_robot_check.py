"""The settings of a run's own virtual robot, looked at before any work that ends with it being started."""

from hydra import compose
from hydra.errors import HydraException
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException

from twbal.cli.config_check import check_configuration, refuse_unread
from twbal.cli.hydra_errors import explained
from twbal.cli.robot_file import is_robot_file
from twbal.cli.sim_files import with_files
from twbal.core.errors import ConfigError, TwbalError
from twbal.sysid.recording import SAME_PERIOD
from twbal.virtual_robot.process import settings_of

_STAGE = "virtual-robot"


def check_virtual_robot(cfg: DictConfig) -> None:
    """Refuse settings with which the virtual robot of a run would not start, or would be another one than the sheet's.

    To be called within a stage. A robot on a port is left alone.

    Args:
        cfg: of a stage with `robot` and `link`.

    Raises:
        ConfigError: one of `link.robot`, `link.seed`, `link.clock` and `link.overrides` cannot be right.
    """
    link = cfg.link
    if "overrides" not in link:
        return
    words = settings_of(str(link.robot), link.seed, str(link.clock), [*map(str, link.overrides or ())], None)
    if any(word.startswith("-") or is_robot_file(word) for word in words if word.startswith(("-", "robot="))):
        return  # flags, and sheets by their path: the process that is started reads these
    try:
        served = compose("virtual_robot", with_files(words))
        check_configuration(served, _STAGE)
        refuse_unread(served, _STAGE, words)
    except (HydraException, OmegaConfBaseException) as error:
        raise _refused(explained(error, _STAGE)) from error
    except TwbalError as error:
        raise _refused(error) from error
    sheet, own = float(cfg.robot.control_period), float(served.robot.control_period)
    if abs(own - sheet) > SAME_PERIOD:
        others = [word for word in map(str, link.overrides or ()) if not word.startswith("robot.control_period=")]
        advised = ",".join(f'"{word}"' for word in [*others, f"robot.control_period={sheet!r}"])
        raise ConfigError(
            f"The virtual robot has a control period of {own:g} s; robot.control_period is {sheet:g} s. Give it the "
            f"same one: 'link.overrides=[{advised}]'. A sheet of your own (robot=...) has it for both."
        )


def _refused(error: TwbalError) -> ConfigError:
    return ConfigError(f"The virtual robot of link.robot, link.seed, link.clock and link.overrides cannot be: {error}")
