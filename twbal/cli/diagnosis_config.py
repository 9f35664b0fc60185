"""The diagnosis that a configuration describes."""

from collections.abc import Sequence

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.cli.composed import composed
from twbal.cli.typed_config import members, typed
from twbal.diagnosis.inputs import DataSettings, DiagnosedSimulation
from twbal.diagnosis.settings import Settings
from twbal.effects.library import values_of


def diagnosis_of(cfg: DictConfig) -> tuple[DiagnosedSimulation, Settings, DataSettings]:
    """The simulation that is held against the data, how effects are named, and what is read of the data."""
    simulation = DiagnosedSimulation(
        instantiate(cfg.robot), values_of(members(cfg.sim.effects)), float(cfg.sim.physics_step)
    )
    return simulation, instantiate(cfg.diagnosis), typed(DataSettings, cfg)


def composed_diagnosis(overrides: Sequence[str] = ()) -> DictConfig:
    """The configuration of `twbal diagnose` with these words, for episodes that are no files.

    Raises:
        ConfigError: an override that the stage does not take, or a value that cannot be right.
    """
    return composed("diagnose", ["episodes=in_memory", *overrides])
