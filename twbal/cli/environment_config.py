"""The environment that a configuration describes."""

from collections.abc import Sequence

from hydra import compose, initialize_config_dir
from hydra.errors import HydraException
from hydra.utils import instantiate
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException

from twbal.cli.conf_folder import conf_folder
from twbal.cli.config_check import check_configuration
from twbal.cli.hydra_errors import complaint
from twbal.cli.sim_files import with_files
from twbal.cli.simulation_config import plant_maker
from twbal.environment.two_wheeled import TwoWheeled


def make(overrides: Sequence[str] = (), render_mode: str | None = None) -> TwoWheeled:
    """The environment of `twbal train-agent` with these words; what `gymnasium.make("twbal/TwoWheeled-v0")` calls.

    Args:
        overrides: such as `["robot=regbot", "sim=regbot", "+effect@sim.effects.dead_zone=dead_zone"]`.
        render_mode: "rgb_array", or None.

    Raises:
        ConfigError: a word that the configuration does not take, or a value that cannot be right.
    """
    try:
        with initialize_config_dir(str(conf_folder()), version_base="1.3"):
            cfg = compose("train_agent", with_files(overrides))
            check_configuration(cfg, "train-agent")
        return environment_of(cfg, render_mode)
    except (HydraException, OmegaConfBaseException) as error:
        raise complaint(error, "train-agent") from error


def environment_of(cfg: DictConfig, render_mode: str | None = None) -> TwoWheeled:
    """The environment that `cfg` describes; trial k is the one that `sim-collect` drives with the same seed."""
    robot, channels, cost, rule = (instantiate(cfg[part]) for part in ("robot", "state", "cost", "rule"))
    return TwoWheeled(plant_maker(cfg, int(cfg.seed))(), robot, channels, cost, rule, render_mode)
