"""What a policy is."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np

from twbal.core.errors import CheckpointError
from twbal.core.gaussian import Array
from twbal.core.payload import Payload

LARGEST = 1e9
"""Parameters of a saved policy beyond ± this are refused: with them a command could overflow."""
_MOST_CHANNELS = 64
_STRONGEST = 1e6  # N·m
_PERIODS = (1e-6, 1e3)  # s
Controller = Callable[[Array], float]
"""One rollout's law: from the state (D,) to the command [N·m]."""


class Policy(ABC):
    """Gives out a controller for each rollout.

    What a law must remember within a rollout (a held random torque, a noise stream) lives in its controller, so the
    policy itself never changes.
    """

    @abstractmethod
    def controller(self, rng: np.random.Generator) -> Controller:
        """The law for one rollout; whatever is random in it is drawn from `rng`."""


class Law(Policy):
    """A policy whose command follows from the state alone."""

    @abstractmethod
    def command(self, states: Array) -> Array:
        """u [N·m] of shape (...) for states (..., D)."""

    def controller(self, rng: np.random.Generator) -> Controller:
        """The law itself; nothing in it is random."""
        return lambda state: float(self.command(state))


@runtime_checkable
class BoundedPolicy(Protocol):
    """A policy that tells its largest command."""

    @property
    def max_command(self) -> float:
        """u_max [N·m]."""


@runtime_checkable
class PeriodicPolicy(Protocol):
    """A policy that may tell the control period of the robot that it was made for."""

    @property
    def control_period(self) -> float | None:
        """[s]; None: not known."""


@runtime_checkable
class PolicyOfChannels(Protocol):
    """A policy that tells which state it reads."""

    @property
    def channels(self) -> Sequence[str]:
        """Names of the channels, in order."""


def common_values(payload: Payload) -> dict[str, Any]:
    """What every saved policy has: its `channels`, `max_command` and `control_period`, which None says is not known.

    Raises:
        CheckpointError: there are no channels, too many, or one twice; or a number is out of its range.
    """
    channels = payload.texts("channels")
    if not 1 <= len(channels) <= _MOST_CHANNELS or len(set(channels)) < len(channels):
        raise CheckpointError(
            f"A policy reads 1 to {_MOST_CHANNELS} distinct channels; found {len(channels)}: {str(channels)[:80]}."
        )
    return {
        "channels": channels,
        "max_command": payload.number("max_command", 1e-9, _STRONGEST),
        "control_period": payload.number("control_period", *_PERIODS) if "control_period" in payload.names else None,
    }


def known_values(policy: Policy) -> dict[str, Any]:
    """The fields of a policy for its checkpoint; without the control period where that is not known."""
    return {name: value for name, value in vars(policy).items() if name != "control_period" or value is not None}
