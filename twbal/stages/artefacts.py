"""Names and places of what stages hand to each other."""

import hashlib
from pathlib import Path

from omegaconf import DictConfig

from twbal.files import file_hash
from twbal.stages.settings import recorded


def episode_file(folder: Path, trial: int) -> Path:
    """Where the episode of a trial is logged."""
    return folder / f"trial_{trial:03d}.mcap"


def policy_files(policy: DictConfig) -> list[Path]:
    """The checkpoint of a `policy` node; none where the policy is made without."""
    return [Path(policy.path)] if "path" in policy else []


def policy_hash(policy: DictConfig) -> str:
    """sha256 of the checkpoint of a `policy` node, or of its settings where the policy is made without.

    Raises:
        DataError: the checkpoint cannot be read.
    """
    files = policy_files(policy)
    return file_hash(files[0]) if files else hashlib.sha256(recorded(policy, ()).encode()).hexdigest()
