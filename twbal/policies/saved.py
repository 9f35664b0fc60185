"""Policies from checkpoints."""

from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

from twbal.core.errors import CheckpointError, ConfigError
from twbal.io.checkpoint import load_checkpoint
from twbal.policies.linear import LinearPolicy
from twbal.policies.mlp import MlpPolicy
from twbal.policies.rbf import RbfPolicy

_Kind = TypeVar("_Kind", RbfPolicy, LinearPolicy)

SavedPolicy = RbfPolicy | LinearPolicy | MlpPolicy
"""What a checkpoint can hold."""

_KINDS: dict[str, type[RbfPolicy] | type[LinearPolicy] | type[MlpPolicy]] = {
    "rbf": RbfPolicy,
    "linear": LinearPolicy,
    "mlp": MlpPolicy,
}


def load_policy(path: str | Path, channels: Sequence[str] | None = None) -> SavedPolicy:
    """The policy in the checkpoint `path`, of the kind that its payload's `law` says (without one: "rbf").

    Args:
        path: a `policy.pt`.
        channels: names of the state channels that it will be given; None: whichever it reads.

    Raises:
        CheckpointError: the file cannot be read, or holds no policy.
        ConfigError: the policy reads other channels.
    """
    payload = load_checkpoint(Path(path), "policy")
    law = payload.get("law", "rbf")
    if not isinstance(law, str) or law not in _KINDS:
        raise CheckpointError(
            f"The policy in {path} is of the kind {str(law)[:40]!r}; this twbal knows {', '.join(_KINDS)}. "
            "Was it made by a newer one?"
        )
    try:
        policy = _KINDS[law].from_payload(payload)
    except CheckpointError as error:
        raise CheckpointError(f"The policy in {path} cannot be used. {error}") from error
    if channels is not None and policy.channels != tuple(channels):
        raise ConfigError(
            f"The policy in {path} reads the state {', '.join(policy.channels)}; here it is {', '.join(channels)}. "
            "Choose the state that it was made with by state=..., and the robot by robot=... (a robot's control period "
            "decides how many past commands its state has)."
        )
    return policy


def load_searched_policy(path: str | Path, channels: Sequence[str]) -> RbfPolicy:
    """The policy in the checkpoint `path`, which must be of the kind that is searched; else as `load_policy`."""
    return _of_kind(RbfPolicy, "one that is searched, of `twbal optimise-policy`", path, channels)


def load_regulator(path: str | Path, channels: Sequence[str]) -> LinearPolicy:
    """The policy in the checkpoint `path`, which must be a regulator; else as `load_policy`."""
    return _of_kind(LinearPolicy, "a regulator, of `twbal lqr`", path, channels)


def _of_kind(kind: type[_Kind], expected: str, path: str | Path, channels: Sequence[str]) -> _Kind:
    policy = load_policy(path, channels)
    if not isinstance(policy, kind):
        raise ConfigError(f"The policy in {path} is a {type(policy).__name__}; expected is {expected}.")
    return policy
