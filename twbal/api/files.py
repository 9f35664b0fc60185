"""Policies, models and episodes in files."""

from collections.abc import Sequence
from pathlib import Path

from twbal.algorithm import model_file
from twbal.cli.artefacts import episode_files
from twbal.core.episode import Episode
from twbal.io.checkpoint import save_checkpoint
from twbal.io.logs import read_episode
from twbal.models.dynamics import DynamicsModel
from twbal.policies import saved
from twbal.policies.saved import SavedPolicy

PathLike = str | Path


def load_policy(path: PathLike, channels: Sequence[str] | None = None) -> SavedPolicy:
    """The policy in a `policy.pt`.

    Args:
        path: of the file.
        channels: names of the state channels that it must read; None: whichever it reads.

    Raises:
        CheckpointError: the file cannot be read, or holds no policy.
        ConfigError: the policy reads other channels.

    >>> import twbal
    >>> policy = twbal.load_policy("data/regression/policy.pt")
    >>> policy.channels
    ('tilt', 'tilt_rate', 'speed', 'command_1', 'command_2')
    """
    return saved.load_policy(path, channels)


def save_policy(path: PathLike, policy: SavedPolicy) -> str:
    """Write a policy as a `policy.pt`, which every command takes; returns the sha256 of the file.

    Raises:
        DataError: the file cannot be written.

    >>> import tempfile, twbal
    >>> policy = twbal.load_policy("data/regression/policy.pt")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     sha256 = twbal.save_policy(f"{folder}/policy.pt", policy)
    >>> len(sha256)
    64
    """
    return save_checkpoint(Path(path), "policy", policy.to_payload())


def load_model(path: PathLike) -> DynamicsModel:
    """The model of the dynamics, f + g, in a `model.pt`.

    Raises:
        CheckpointError: the file cannot be read, or holds no model.

    >>> import numpy as np, twbal
    >>> model = twbal.load_model("data/regression/model.pt")
    >>> states = np.zeros((3, len(model.channels.names)))  # upright, at rest
    >>> model.step_mean(states, np.zeros(3)).shape
    (3, 5)
    """
    return model_file.load_model(Path(path)).model


def read_episodes(paths: PathLike | Sequence[PathLike]) -> list[Episode]:
    """Episodes: source by source, and sorted by name within each.

    Args:
        paths: a log, a folder of logs or a run folder; or several of these.

    Raises:
        LogError: a source is not there, has no log in it, or a log cannot be read.

    >>> import twbal
    >>> episodes = twbal.read_episodes("data/regression/real")
    >>> episodes[0].observations.shape[1]  # time, tilt, tilt rate, ...; see `twbal.core.plant.Observation`
    7
    """
    sources = [paths] if isinstance(paths, str | Path) else list(paths)
    return [read_episode(file) for file in episode_files([str(source) for source in sources])]
