"""A neural network as a policy: what a model-free agent learns."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from twbal.core.errors import CheckpointError
from twbal.core.gaussian import Array
from twbal.core.payload import Payload
from twbal.policies.policy import LARGEST, Law, common_values, known_values

_Function = Callable[[Array], Array]
_ACTIVATIONS: Mapping[str, _Function] = {"tanh": np.tanh, "relu": lambda x: np.maximum(x, 0.0)}
_SQUASHES: Mapping[str, _Function] = {"tanh": np.tanh, "clip": lambda x: np.clip(x, -1.0, 1.0)}
_FAR = 1e100
"""States are cut off here, where products would overflow: the command is to be a number for any state."""
_DEEPEST, _WIDEST = 16, 4096
"""Layers of a network, and units of one: more are too slow for a control period."""


@dataclass(frozen=True, eq=False)
class MlpPolicy(Law):
    """u = u_max σ(W_L h_{L-1} + b_L) with h_l = a(W_l h_{l-1} + b_l) and h_0 = x, in [-u_max, u_max] for every x.

    Attributes:
        channels: names of the D state channels that it reads.
        weights: W_l, (N_l, N_{l-1}) each; N_0 = D, N_L = 1. The first takes the state in the channels' units.
        biases: b_l, (N_l,) each.
        activation: a, "tanh" or "relu".
        squash: σ, "tanh", or "clip" to [-1, 1].
        max_command: u_max [N·m].
        control_period: of the robot that it was made for [s]; None: not known.

    Raises:
        CheckpointError: the layers do not fit together, or a function is not known.
    """

    channels: tuple[str, ...]
    weights: tuple[Array, ...]
    biases: tuple[Array, ...]
    activation: str
    squash: str
    max_command: float
    control_period: float | None = None

    def __post_init__(self) -> None:
        for name, known in (("activation", _ACTIVATIONS), ("squash", _SQUASHES)):
            if getattr(self, name) not in known:
                raise CheckpointError(
                    f"A network's {name} is {' or '.join(known)}; found {getattr(self, name)!r}. Train it with one."
                )
        widths = [len(self.channels), *map(len, self.biases)]
        expected = list(zip(widths[1:], widths, strict=False))
        found = [np.shape(layer) for layer in self.weights]
        if found != expected or widths[-1] != 1 or not self.biases:
            raise CheckpointError(
                f"The layers of a network from {widths[0]} channels to 1 command do not fit together: biases of "
                f"{widths[1:]}, weights of {found}. Was the file changed by hand? Train it again."
            )

    def command(self, states: Array) -> Array:
        """u [N·m] of shape (...) for states (..., D)."""
        hidden = np.clip(states, -_FAR, _FAR)
        *inner, last = zip(self.weights, self.biases, strict=True)
        for W, b in inner:
            hidden = _ACTIVATIONS[self.activation](hidden @ W.T + b)  # (..., N_l)
        W, b = last
        command: Array = self.max_command * _SQUASHES[self.squash](hidden @ W[0] + b[0])
        return command

    def to_payload(self) -> dict[str, Any]:
        """Plain values and arrays, for a checkpoint."""
        lists = {name: list(getattr(self, name)) for name in ("channels", "weights", "biases")}
        return {"law": "mlp", **known_values(self), **lists}

    @classmethod
    def from_payload(cls, payload: dict[str, Any]) -> Self:
        """Back from `to_payload`.

        Raises:
            CheckpointError: a part is missing, cannot be one of a policy, or does not fit the others.
        """
        found = Payload("policy", payload)
        weights, biases = (_layers(found, name, rank) for name, rank in (("weights", 2), ("biases", 1)))
        activation, squash = found.text("activation"), found.text("squash")
        return cls(weights=weights, biases=biases, activation=activation, squash=squash, **common_values(found))


def _layers(found: Payload, name: str, rank: int) -> tuple[Array, ...]:
    layers = found.items(name)
    if len(layers) > _DEEPEST:
        raise CheckpointError(f"A network has at most {_DEEPEST} layers; found {len(layers)} {name}.")
    each = Payload("policy", {f"{name}[{i}]": layer for i, layer in enumerate(layers)})
    arrays = tuple(each.numbers(part, (-1,) * rank, -LARGEST, LARGEST) for part in each.values)
    if any(max(array.shape) > _WIDEST for array in arrays):
        raise CheckpointError(f"A network's layers are at most {_WIDEST} wide; the policy's {name} are wider.")
    return arrays
