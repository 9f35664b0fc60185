"""`model.pt`: a model of the dynamics, and the logs that it came from."""

from pathlib import Path
from typing import NamedTuple

from twbal.core.errors import CheckpointError, ConfigError
from twbal.core.payload import Payload
from twbal.io.checkpoint import load_checkpoint, save_checkpoint
from twbal.models.dynamics import DynamicsModel


class SavedModel(NamedTuple):
    """What is in a `model.pt`.

    Attributes:
        model: of the dynamics.
        episodes: sha256 of the logs that it came from, by source ("simulation", "robot").
    """

    model: DynamicsModel
    episodes: dict[str, list[str]]


def load_model(path: Path) -> SavedModel:
    """Read a `model.pt`.

    Raises:
        CheckpointError: it cannot be read, or holds no model.
    """
    payload = load_checkpoint(path, "model")
    try:
        episodes = Payload("model's episodes", payload.get("episodes", {}))
        return SavedModel(
            DynamicsModel.from_payload(payload), {name: list(episodes.texts(name)) for name in episodes.names}
        )
    except (CheckpointError, ConfigError) as error:
        raise CheckpointError(f"The model in {path} cannot be used. {error}") from error


def save_model(path: Path, saved: SavedModel) -> None:
    """Write a `model.pt`."""
    save_checkpoint(path, "model", {**saved.model.to_payload(), "episodes": saved.episodes})
