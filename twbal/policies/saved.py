"""Policies from checkpoints."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from twbal.checkpoint import load_checkpoint
from twbal.errors import CheckpointError, ConfigError
from twbal.policies.linear import LinearPolicy
from twbal.policies.policy import Policy
from twbal.policies.rbf import RbfPolicy

_RBF = "rbf"  # what a payload is that names no kind


class _Kind(Protocol):
    def from_payload(self, payload: dict[str, Any]) -> Policy: ...


_KINDS: Mapping[str, _Kind] = {_RBF: RbfPolicy, LinearPolicy.KIND: LinearPolicy}


def load_policy(path: str | Path, channels: Sequence[str]) -> Policy:
    """The policy in the checkpoint `path`.

    Args:
        path: a `policy.pt`.
        channels: names of the state channels that it will be given.

    Raises:
        CheckpointError: the file cannot be read, or holds no policy.
        ConfigError: the policy reads other channels.
    """
    payload = load_checkpoint(Path(path), "policy")
    kind = str(payload.get("kind", _RBF))
    if kind not in _KINDS:
        raise CheckpointError(f"{path} holds a policy of the kind {kind!r}; this version knows: {', '.join(_KINDS)}.")
    policy = _KINDS[kind].from_payload(payload)
    reads = tuple(getattr(policy, "channels", ()))
    if reads != tuple(channels):
        raise ConfigError(
            f"The policy in {path} reads the state {', '.join(reads)}; here it is {', '.join(channels)}. "
            "Choose the state that it was made with by state=..."
        )
    return policy


def load_network(path: str | Path, channels: Sequence[str]) -> RbfPolicy:
    """The radial-basis policy in a checkpoint: what a search can begin at; see `load_policy`.

    Raises:
        CheckpointError: it is a policy of another kind.
    """
    policy = load_policy(path, channels)
    if not isinstance(policy, RbfPolicy):
        raise CheckpointError(
            f"{path} holds a {type(policy).__name__}; a search begins at, and judges, radial-basis policies only. "
            "Give it a policy.pt of optimise-policy."
        )
    return policy


def load_regulator(path: str | Path, channels: Sequence[str]) -> LinearPolicy:
    """The regulator in a checkpoint; see `load_policy`.

    Raises:
        CheckpointError: it is a policy of another kind.
    """
    policy = load_policy(path, channels)
    if not isinstance(policy, LinearPolicy):
        raise CheckpointError(
            f"{path} holds a {type(policy).__name__}; expected is a regulator. Give it a policy.pt of linear-policy."
        )
    return policy
