"""What `known=` says of a robot before it is driven: what `twbal identify` told from logs of it."""

from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.algorithm.distribution_file import load_distribution
from twbal.algorithm.settings import InitialPolicy
from twbal.cli.artefacts import DISTRIBUTION
from twbal.core.errors import CheckpointError, ConfigError
from twbal.planar.robot_distribution import RobotDistribution


def distribution_file(given: str | None) -> Path | None:
    """The absolute path of the file that `known=` names, by itself or by the run folder of identify; None: of none."""
    if not given:
        return None
    path = Path(given).absolute()
    return path / DISTRIBUTION if path.is_dir() else path


def known_robot(cfg: DictConfig) -> RobotDistribution | None:
    """What `known` of a configuration of `iterate` tells; None where nothing is known before.

    Raises:
        CheckpointError: the file cannot be read.
        ConfigError: it is about another robot, or nothing would use it.
    """
    file = distribution_file(cfg.known)
    if file is None:
        return None
    if not cfg.robust or cfg.initial_policy != InitialPolicy.SIMULATION:
        raise ConfigError(
            f"known=... tells of the robots for which policy 0 is searched in simulation, and here it is not searched "
            f"for any: robust={'given' if cfg.robust else 'none'}, initial_policy={cfg.initial_policy} (method="
            f"{cfg.method}). Leave known=... out, or choose method=twbal."
        )
    if not file.is_file():
        raise CheckpointError(
            f"The distribution in {cfg.known} cannot be used: there is no file {file}. Expected by known=... is the "
            f"run folder of `twbal identify`, or the {DISTRIBUTION} in it."
        )
    return load_distribution(file, instantiate(cfg.robot))
