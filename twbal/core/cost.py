"""The saturating cost of eq. 11 and its expectation under a normal state."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from twbal.core.compiled import kernel
from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array, Gaussian


class ExpectedCost(NamedTuple):
    """E[c(x)] and its derivatives (eq. 14).

    Attributes:
        value: in [0, 1].
        by_mean: (D,).
        by_covariance: (D, D), symmetric.
    """

    value: float
    by_mean: Array
    by_covariance: Array


@kernel()
def expected_cost(target: Array, widths: Array, mean: Array, covariance: Array) -> ExpectedCost:
    """E[c(x)] for x ~ N(m, S): 1 - |I + SP|^(-1/2) exp(-½ dᵀQd).

    Here P = diag(widths⁻²), Q = P (I + SP)⁻¹ and d = m - target; see `SaturatingCost` for the arguments.
    """
    root = 1.0 / widths
    across = root.reshape(-1, 1)
    inside = np.eye(len(root)) + across * covariance * root  # I + √P S √P, symmetric
    Q = across * np.linalg.inv(inside) * root
    gap = mean - target
    pull = Q @ gap
    reward = np.exp(-0.5 * (gap @ pull + np.linalg.slogdet(inside)[1]))
    return ExpectedCost(1.0 - reward, reward * pull, 0.5 * reward * (Q - np.outer(pull, pull)))


@dataclass(frozen=True, eq=False)
class SaturatingCost:
    """c(x) = 1 - exp(-½ Σ_k ((x_k - target_k) / width_k)²) (eq. 11; the paper has one width a for all channels).

    Attributes:
        target: (D,).
        widths: (D,) in the channels' units; infinite where a channel costs nothing.
    """

    target: Array
    widths: Array

    def __call__(self, states: Array) -> Array:
        """c of shape (...) for states (..., D)."""
        cost: Array = -np.expm1(-0.5 * (((states - self.target) / self.widths) ** 2).sum(axis=-1))
        return cost

    def expected(self, state: Gaussian) -> ExpectedCost:
        """E[c(x)] for x ~ N(m, S), in closed form."""
        return expected_cost(self.target, self.widths, *map(np.ascontiguousarray, state))


def cost_over(
    channels: Sequence[str], widths: Mapping[str, float], command_width: float | None, torque_limit: float
) -> SaturatingCost:
    """The cost over named channels, with its target at zero.

    Args:
        channels: of the state, D names.
        widths: by channel name, in the channel's unit; channels without one cost nothing.
        command_width: of `command_1`, the action's price, as a share of the torque limit; None costs nothing.
        torque_limit: [N·m].

    Raises:
        ConfigError: a width is not positive, or nothing has a price.
    """
    priced = dict(widths)
    if command_width is not None:
        priced["command_1"] = command_width * torque_limit
    found = np.array([priced.get(name, np.inf) for name in channels], dtype=np.float64)
    if not (found > 0).all() or not np.isfinite(found).any():
        raise ConfigError(
            f"The cost needs positive widths, at least one of them for the state {', '.join(channels)}; found {priced}."
        )
    return SaturatingCost(np.zeros(len(found)), found)
