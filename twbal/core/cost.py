"""What a state costs: the saturating cost of eq. 11, and what any other cost is derived from."""

import hashlib
import inspect
import sys
from abc import ABC, abstractmethod
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from twbal.core.compiled import kernel, method_kernel, specialised
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
class Cost(ABC):
    """What a state costs: 0 at the target, at most 1.

    A cost is a frozen dataclass (with `eq=False`) with two methods. The search compiles them by numba, with `self` a
    named tuple of the fields: they use the fields, numbers, numpy and kernels, and call no other method.

    Attributes:
        target: (D,).
        widths: (D,) in the channels' units; infinite where a channel costs nothing. A linear-quadratic regulator takes
            them for the deviations that cost alike.
    """

    target: Array
    widths: Array

    @classmethod
    def over(
        cls, channels: Sequence[str], widths: Mapping[str, float], command_width: float | None, torque_limit: float
    ) -> "Cost":
        """This cost over named channels; see `cost_over`."""
        return cost_over(channels, widths, command_width, torque_limit, cls)

    @abstractmethod
    def at(self, state: Array) -> float:
        """c(x) of one state (D,), in [0, 1]."""

    @abstractmethod
    def expected_at(self, mean: Array, covariance: Array) -> ExpectedCost:
        """E[c(x)] for x ~ N(mean (D,), covariance (D, D)); a covariance of 0 gives c and its slope."""

    def __call__(self, states: Array) -> Array:
        """c of shape (...) for states (..., D)."""
        return np.apply_along_axis(self.at, -1, states)

    def expected(self, state: Gaussian) -> ExpectedCost:
        """E[c(x)] for x ~ N(m, S)."""
        return self.expected_at(*map(np.ascontiguousarray, state))

    @property
    def numbers(self) -> "CostNumbers":
        """The fields, for kernels."""
        values = (np.ascontiguousarray(getattr(self, f.name), dtype=np.float64) for f in fields(self))
        numbers: CostNumbers = _numbers_class(type(self))(*values)
        return numbers


CostNumbers = Any
"""The fields of a cost as a named tuple of arrays. Each cost has a class of its own, for which kernels are compiled."""

_CLASS = "CostNumbers_"


@cache
def _numbers_class(kind: type[Cost]) -> Any:
    # Machine code is kept by the name of this class, which therefore stands for the code of costs from outside.
    source = Path(inspect.getfile(kind)).read_bytes() + kind.__qualname__.encode()
    name = _CLASS + hashlib.sha256(source).hexdigest()[:16]
    made = type(name, (namedtuple(name, [f.name for f in fields(kind)]),), {"__module__": __name__, "kind": kind})
    setattr(sys.modules[__name__], name, made)
    return made


def __getattr__(name: str) -> Any:
    """A class for which machine code was kept, of a cost that there is not in this process: never the class in use.

    Raises:
        AttributeError: the name is no such class's.
    """
    if name.startswith(_CLASS):
        return namedtuple(name, ())
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def _pricing(*types: Any) -> Callable[..., Any]:
    method = method_kernel(types[0].instance_class.kind, "at", types, float)
    return lambda cost, state: method(cost, state)


def _expecting(*types: Any) -> Callable[..., Any]:
    method = method_kernel(types[0].instance_class.kind, "expected_at", types, ExpectedCost)
    return lambda cost, mean, covariance: method(cost, mean, covariance)


@specialised(_pricing)
def price(cost: CostNumbers, state: Array) -> float:
    """`Cost.at`, for kernels."""
    raise NotImplementedError


@specialised(_expecting)
def expected_price(cost: CostNumbers, mean: Array, covariance: Array) -> ExpectedCost:
    """`Cost.expected_at`, for kernels."""
    raise NotImplementedError


@dataclass(frozen=True, eq=False)
class SaturatingCost(Cost):
    """c(x) = 1 - exp(-½ Σ_k ((x_k - target_k) / width_k)²) (eq. 11; the paper has one width a for all channels).

    Attributes:
        target: (D,).
        widths: (D,) in the channels' units; infinite where a channel costs nothing.
    """

    def at(self, state: Array) -> float:
        """c of one state."""
        distance = 0.0
        for k in range(len(state)):
            distance += ((state[k] - self.target[k]) * (1.0 / self.widths[k])) ** 2
        return float(-np.expm1(-0.5 * distance))

    def expected_at(self, mean: Array, covariance: Array) -> ExpectedCost:
        """E[c(x)], in closed form."""
        return expected_cost(self.target, self.widths, mean, covariance)

    def __call__(self, states: Array) -> Array:
        """c of all states at once."""
        cost: Array = -np.expm1(-0.5 * (((states - self.target) / self.widths) ** 2).sum(axis=-1))
        return cost


def cost_over(
    channels: Sequence[str],
    widths: Mapping[str, float],
    command_width: float | None,
    torque_limit: float,
    shape: type[Cost] = SaturatingCost,
) -> Cost:
    """The cost over named channels, with its target at zero.

    Args:
        channels: of the state, D names.
        widths: by channel name, in the channel's unit; channels without one cost nothing.
        command_width: of `command_1`, the action's price, as a share of the torque limit; None costs nothing.
        torque_limit: [N·m].
        shape: class of the cost.

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
    return shape(np.zeros(len(found)), found)
