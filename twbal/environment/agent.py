"""What an agent is, and how it learns."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from twbal.core.channels import Channels
from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array

ALGORITHMS = ("PPO", "SAC")
ACTIVATIONS = ("tanh", "relu")


@dataclass(frozen=True)
class AgentRecipe:
    """An algorithm of Stable-Baselines3 and the networks that it trains.

    Attributes:
        algorithm: "PPO" (on-policy: steady) or "SAC" (off-policy: fewer steps, each at more work).
        hidden: widths of the hidden layers.
        activation: of these, "tanh" or "relu".
        scales: by channel name, in its unit: what the networks see as 1. Past commands have the torque limit.
        options: the algorithm's own, under the names of Stable-Baselines3.

    Raises:
        ConfigError: a name is not known, or a width is not positive.
    """

    algorithm: str
    hidden: Sequence[int]
    activation: str
    scales: Mapping[str, float]
    options: Mapping[str, Any]

    def __post_init__(self) -> None:
        for name, known in (("algorithm", ALGORITHMS), ("activation", ACTIVATIONS)):
            if getattr(self, name) not in known:
                raise ConfigError(f"An agent's {name} is {' or '.join(known)}; found {getattr(self, name)!r}.")
        if not all(width >= 1 for width in self.hidden):
            raise ConfigError(f"Hidden layers of an agent have widths of 1 or more; found {list(self.hidden)}.")

    def state_scales(self, channels: Channels, torque_limit: float) -> Array:
        """What the networks see as 1, (D,).

        Raises:
            ConfigError: a channel has no positive scale.
        """
        known = {**self.scales, **dict.fromkeys(channels.lags, torque_limit)}
        missing = [name for name in channels.names if not known.get(name, 0.0) > 0]
        if missing:
            raise ConfigError(
                f"The agent needs a positive scale for {', '.join(missing)}; found {known}. "
                "Give agent.scales.<channel>=..."
            )
        return np.array([known[name] for name in channels.names], dtype=np.float64)
