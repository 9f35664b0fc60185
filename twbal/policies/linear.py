"""A linear law, cut at the torque limit."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from twbal.errors import CheckpointError
from twbal.gaussian import Array
from twbal.policies.policy import Controller, Policy


@dataclass(frozen=True, eq=False)
class LinearPolicy(Policy):
    """u = u_0 - kᵀx, within ±u_max: what a linear-quadratic regulator makes.

    Attributes:
        channels: names of the D state channels that it reads.
        gain: k (D,) [N·m / unit of each channel].
        bias: u_0 [N·m].
        max_command: u_max [N·m].
    """

    channels: tuple[str, ...]
    gain: Array
    bias: float
    max_command: float

    def command(self, states: Array) -> Array:
        """u [N·m] of shape (...) for states (..., D)."""
        command: Array = np.clip(self.bias - states @ self.gain, -self.max_command, self.max_command)
        return command

    def controller(self, rng: np.random.Generator) -> Controller:
        """The law itself; nothing in it is random."""
        return lambda state: float(self.command(state))

    def to_payload(self) -> dict[str, Any]:
        """Plain values and arrays, for a checkpoint."""
        return {"law": "linear", **vars(self), "channels": list(self.channels)}

    @classmethod
    def from_payload(cls, payload: dict[str, Any]) -> Self:
        """Back from `to_payload`.

        Raises:
            CheckpointError: a part is missing.
        """
        try:
            return cls(
                channels=tuple(payload["channels"]),
                gain=np.asarray(payload["gain"]),
                bias=float(payload["bias"]),
                max_command=float(payload["max_command"]),
            )
        except KeyError as missing:
            raise CheckpointError(f"The policy's checkpoint has no {missing}; it has: {', '.join(payload)}.") from None
