"""The policy that is searched: a radial-basis network, optionally with a linear part, behind the squash of eq. 10."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from twbal.core.errors import CheckpointError
from twbal.core.gaussian import Array
from twbal.core.payload import Payload
from twbal.policies.policy import LARGEST, Law, common_values, known_values
from twbal.policies.rbf_moments import Network
from twbal.policies.squash import COMPENSATION_WIDTH, NARROWEST, WIDEST, compensation_of, squash

_FAR = 1e100
"""States are cut off here, where squares would overflow: the command is to be a number for any state."""
_SHORTEST = 1e-9
"""Lengths of a basis function below this are refused, in the channels' units."""
_MOST_COMPENSATION = 0.9
_MOST = 10_000
"""Basis functions of a saved policy: more are too slow for a control period."""


@dataclass(frozen=True, eq=False)
class RbfPolicy(Law):
    """u = u_max σ_c(b + kᵀx + Σ_i w_i exp(-½ (x - c_i)ᵀΛ⁻¹(x - c_i))), in [-u_max, u_max] for every x (eq. 10).

    Attributes:
        channels: names of the D state channels that it reads.
        centres: c (N, D) in the channels' units.
        weights: w (N,).
        lengths: (D,) in the channels' units, Λ = diag(lengths²).
        gain: k (D,), 1 / unit of each channel; zero is the paper's plain network.
        max_command: u_max [N·m].
        bias: b; holds a robot that balances at another tilt than 0.
        compensation: share of u_max that is kept for friction compensation (`squash`); 0 is the paper's policy.
        compensation_width: of the activation, within about ±2 of which the compensation changes its sign.
        control_period: of the robot that it was made for [s]; None: not known.
    """

    channels: tuple[str, ...]
    centres: Array
    weights: Array
    lengths: Array
    gain: Array
    max_command: float
    compensation: float = 0.0
    bias: float = 0.0
    compensation_width: float = COMPENSATION_WIDTH
    control_period: float | None = None

    @property
    def network(self) -> Network:
        """The parameters alone, as moment matching takes them."""
        parts = (self.centres, self.weights, self.lengths, self.gain)
        centres, weights, lengths, gain = (np.ascontiguousarray(part, dtype=np.float64) for part in parts)
        return Network(
            centres,
            weights,
            lengths,
            gain,
            float(self.max_command),
            compensation_of(float(self.compensation), float(self.compensation_width)),
            float(self.bias),
        )

    def activation(self, states: Array) -> Array:
        """What goes into the squash, (...) for states (..., D)."""
        states = np.clip(states, -_FAR, _FAR)
        gaps = (states[..., None, :] - self.centres) / self.lengths  # (..., N, D)
        activation: Array = self.bias + states @ self.gain + np.exp(-0.5 * (gaps**2).sum(axis=-1)) @ self.weights
        return activation

    def command(self, states: Array) -> Array:
        """u [N·m] of shape (...) for states (..., D)."""
        return self.max_command * squash(self.activation(states), self.compensation, self.compensation_width)

    def to_payload(self) -> dict[str, Any]:
        """Plain values and arrays, for a checkpoint."""
        return {**known_values(self), "channels": list(self.channels)}

    @classmethod
    def from_payload(cls, payload: dict[str, Any]) -> Self:
        """Back from `to_payload`.

        Raises:
            CheckpointError: a part is missing, or cannot be one of a policy.
        """
        found = Payload("policy", payload)
        common = common_values(found)
        channels = len(common["channels"])
        centres = found.numbers("centres", (-1, channels), -LARGEST, LARGEST)
        if len(centres) > _MOST:
            raise CheckpointError(f"A policy has at most {_MOST} basis functions; found {len(centres)}.")
        return cls(
            centres=centres,
            weights=found.numbers("weights", (len(centres),), -LARGEST, LARGEST),
            lengths=found.numbers("lengths", (channels,), _SHORTEST, _FAR),
            gain=found.numbers("gain", (channels,), -LARGEST, LARGEST),
            **common,
            **_later_numbers(found),
        )


def _later_numbers(payload: Payload) -> dict[str, Any]:
    """What files of earlier versions do not have."""
    limits = {
        "compensation": (0.0, _MOST_COMPENSATION),
        "bias": (-LARGEST, LARGEST),
        "compensation_width": (NARROWEST, WIDEST),
    }
    return {name: payload.number(name, *limit) for name, limit in limits.items() if name in payload.names}
