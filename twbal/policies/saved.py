"""Policies from checkpoints."""

from collections.abc import Sequence
from pathlib import Path

from twbal.checkpoint import load_checkpoint
from twbal.errors import ConfigError
from twbal.policies.rbf import RbfPolicy


def load_policy(path: str | Path, channels: Sequence[str]) -> RbfPolicy:
    """The policy in the checkpoint `path`.

    Args:
        path: a `policy.pt`.
        channels: names of the state channels that it will be given.

    Raises:
        CheckpointError: the file cannot be read, or holds no policy.
        ConfigError: the policy reads other channels.
    """
    policy = RbfPolicy.from_payload(load_checkpoint(Path(path), "policy"))
    if policy.channels != tuple(channels):
        raise ConfigError(
            f"The policy in {path} reads the state {', '.join(policy.channels)}; here it is {', '.join(channels)}. "
            "Choose the state that it was made with by state=..."
        )
    return policy
