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


def channels_in(payload: Payload) -> tuple[str, ...]:
    """The state channels that a saved policy reads.

    Raises:
        CheckpointError: there are none, too many, or one twice.
    """
    channels = payload.texts("channels")
    if not 1 <= len(channels) <= _MOST_CHANNELS or len(set(channels)) < len(channels):
        raise CheckpointError(
            f"A policy reads 1 to {_MOST_CHANNELS} distinct channels; found {len(channels)}: {str(channels)[:80]}."
        )
    return channels


def max_command_in(payload: Payload) -> float:
    """The largest command of a saved policy [N·m]; positive."""
    return payload.number("max_command", 1e-9, _STRONGEST)


def known_values(policy: Policy) -> dict[str, Any]:
    """The fields of a policy for its checkpoint; without the control period where that is not known."""
    return {name: value for name, value in vars(policy).items() if name != "control_period" or value is not None}


def control_period_in(payload: Payload) -> float | None:
    """The control period that a saved policy was made for [s]; None: it does not say."""
    return payload.number("control_period", *_PERIODS) if "control_period" in payload.names else None
