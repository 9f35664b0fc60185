"""The diagnosis that a configuration describes."""

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.cli.typed_config import members, typed
from twbal.diagnosis.pipeline import DataSettings, Simulated
from twbal.diagnosis.settings import Settings
from twbal.effects.library import values_of


def diagnosis_of(cfg: DictConfig) -> tuple[Simulated, Settings, DataSettings]:
    """The simulation that is held against the data, how effects are named, and what is read of the data."""
    simulation = Simulated(instantiate(cfg.robot), values_of(members(cfg.sim.effects)), float(cfg.sim.physics_step))
    return simulation, instantiate(cfg.diagnosis), typed(DataSettings, cfg)
