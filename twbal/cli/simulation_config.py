"""The simulated robot that a configuration describes."""

from collections.abc import Callable
from functools import partial
from typing import Any, cast

from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from twbal.cli.typed_config import members
from twbal.core.errors import ConfigError
from twbal.core.plant import Plant
from twbal.planar.planar_plant import PlanarPlant
from twbal.sim.bullet_plant import SimPlant
from twbal.sim.randomised import Draws, RandomisedPlant

PYBULLET, PLANAR = "pybullet", "planar"  # engines


def plant_maker(cfg: DictConfig, seed: int) -> Callable[[], Plant]:
    """Makes the robot of `cfg`: in PyBullet, by the analytic equations, or in PyBullet with another one a rollout.

    What it returns can be pickled, for processes that each make their own.

    Raises:
        ConfigError: there is no such engine.
    """
    engine, effects = cfg.sim.get("engine", PYBULLET), members(cfg.sim.effects)
    told: dict[str, Any] = {
        "robot": instantiate(cfg.robot),
        "start": instantiate(cfg.start),
        "physics_step": float(cfg.sim.physics_step),
        "seed": seed,
    }
    if engine == PLANAR:
        return partial(PlanarPlant, effects=effects, **told)
    if engine != PYBULLET:
        raise ConfigError(f"sim.engine must be {PYBULLET} or {PLANAR}; found {engine!r}.")
    if "draws" in cfg.sim:
        draws = cast(Draws, OmegaConf.to_container(cfg.sim.draws))
        return partial(RandomisedPlant, effects=effects, draws=draws, **told)
    return partial(SimPlant, effects=effects, **told)
