"""A simulation from a file: `sim=outputs/diagnose/.../augmented.yaml` instead of a choice of the group `sim`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException
from yaml import YAMLError

from twbal.errors import ConfigError
from twbal.stages.commands import text

_KEY, _ENDINGS = "sim=", (".yaml", ".yml")
_PARTS = {"physics_step", "effects"}


def with_files(words: Sequence[str]) -> list[str]:
    """Overrides in which a simulation from a file stands as what the file says.

    Raises:
        ConfigError: the file is not there, or holds no simulation.
    """
    found: list[str] = []
    for word in words:
        path = word.removeprefix(_KEY).strip("'\"")
        is_file = word.startswith(_KEY) and path.endswith(_ENDINGS)
        found += _as_overrides(Path(path)) if is_file else [word]
    return found


def _as_overrides(path: Path) -> list[str]:
    sim = _read(path)
    effects = sim.get("effects") or {}
    step = [f"sim.physics_step={text(sim['physics_step'])}"] if "physics_step" in sim else []
    return [*step, *(f"++sim.effects.{name}={text(effect)}" for name, effect in effects.items())]


def _read(path: Path) -> dict[str, Any]:
    try:
        sim = OmegaConf.to_container(OmegaConf.load(path))
    except FileNotFoundError as error:
        raise ConfigError(f"There is no simulation {path}. `twbal diagnose` writes such files.") from error
    except (OSError, UnicodeDecodeError, YAMLError, OmegaConfBaseException) as error:
        raise ConfigError(f"The simulation {path} cannot be read: {error}") from error
    if not isinstance(sim, dict) or not set(sim) <= _PARTS or not isinstance(sim.get("effects", {}), dict | None):
        what = ", ".join(map(str, sim)) if isinstance(sim, dict) else type(sim).__name__
        raise ConfigError(f"{path} is no simulation: it has {what}; expected {', '.join(sorted(_PARTS))}.")
    return {str(key): value for key, value in sim.items()}
