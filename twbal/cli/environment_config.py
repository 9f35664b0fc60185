"""The environment that a configuration describes."""

from collections.abc import Sequence

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.cli.composed import composed
from twbal.cli.simulation_config import simulation_of
from twbal.environment.two_wheeled import TwoWheeled


def make(overrides: Sequence[str] = (), render_mode: str | None = None) -> TwoWheeled:
    """The environment of `twbal train-agent` with these words; what `gymnasium.make("twbal/TwoWheeled-v0")` calls.

    Args:
        overrides: such as `["robot=regbot", "sim=regbot", "+effect@sim.effects.dead_zone=dead_zone"]`.
        render_mode: "rgb_array", or None.

    Raises:
        ConfigError: a word that the configuration does not take, or a value that cannot be right.
    """
    return environment_of(composed("train-agent", overrides), render_mode)


def environment_of(cfg: DictConfig, render_mode: str | None = None) -> TwoWheeled:
    """The environment that `cfg` describes; trial k is the one that `sim-collect` drives with the same seed."""
    robot, channels, cost, rule = (instantiate(cfg[part]) for part in ("robot", "state", "cost", "success"))
    return TwoWheeled(simulation_of(cfg).plant(int(cfg.seed)), robot, channels, cost, rule, render_mode)
