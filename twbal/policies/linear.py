"""A linear law, cut at the torque limit."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from twbal.core.gaussian import Array
from twbal.core.payload import Payload
from twbal.policies.policy import LARGEST, Law, common_values, known_values


@dataclass(frozen=True, eq=False)
class LinearPolicy(Law):
    """u = u_0 - kᵀx, within ±u_max: what a linear-quadratic regulator makes.

    Attributes:
        channels: names of the D state channels that it reads.
        gain: k (D,) [N·m / unit of each channel].
        bias: u_0 [N·m].
        max_command: u_max [N·m].
        control_period: of the robot that it was made for [s]; None: not known.
    """

    channels: tuple[str, ...]
    gain: Array
    bias: float
    max_command: float
    control_period: float | None = None

    def command(self, states: Array) -> Array:
        """u [N·m] of shape (...) for states (..., D)."""
        command: Array = np.clip(self.bias - states @ self.gain, -self.max_command, self.max_command)
        return command

    def to_payload(self) -> dict[str, Any]:
        """Plain values and arrays, for a checkpoint."""
        return {"law": "linear", **known_values(self), "channels": list(self.channels)}

    @classmethod
    def from_payload(cls, payload: dict[str, Any]) -> Self:
        """Back from `to_payload`.

        Raises:
            CheckpointError: a part is missing, or cannot be one of a policy.
        """
        found = Payload("policy", payload)
        common = common_values(found)
        return cls(
            gain=found.numbers("gain", (len(common["channels"]),), -LARGEST, LARGEST),
            bias=found.number("bias", -LARGEST, LARGEST),
            **common,
        )
