"""The simulated robot that a configuration describes."""

from typing import cast

from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from twbal.algorithm.simulation import EngineName, Simulation
from twbal.cli.typed_config import members
from twbal.core.errors import ConfigError
from twbal.sim.randomised import Draws


def simulation_of(cfg: DictConfig) -> Simulation:
    """What `robot`, `start` and `sim` of a configuration say.

    Raises:
        ConfigError: there is no such engine.
    """
    engine = cfg.sim.get("engine", EngineName.PYBULLET.value)
    if engine not in list(EngineName):
        raise ConfigError(f"sim.engine must be {' or '.join(EngineName)}; found {engine!r}.")
    return Simulation(
        robot=instantiate(cfg.robot),
        start=instantiate(cfg.start),
        physics_step=float(cfg.sim.physics_step),
        effects=members(cfg.sim.effects),
        engine=EngineName(engine),
        draws=cast(Draws, OmegaConf.to_container(cfg.sim.draws)) if "draws" in cfg.sim else {},
    )
