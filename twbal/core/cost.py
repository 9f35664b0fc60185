"""What a state costs: the saturating cost of eq. 11, and what any other cost is derived from."""

import hashlib
import inspect
import sys
from abc import ABC, abstractmethod
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from twbal.core.compiled import kernel, method_kernel, specialised
from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array, Gaussian
from twbal.core.threads import made_once


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
def expected_cost(target: Array, widths: Array, change: Array, mean: Array, covariance: Array) -> ExpectedCost:
    """E[c(x)] for x ~ N(m, S): 1 - |I + SP|^(-1/2) exp(-½ dᵀQd).

    Here P = FᵀF with the rows diag(1 / widths) and `change` in F, Q = P (I + SP)⁻¹ = Fᵀ (I + FSFᵀ)⁻¹ F and
    d = m - target; see `SaturatingCost` for the arguments.
    """
    D = len(widths)
    F = np.zeros((D + 1, D))
    for k in range(D):
        F[k, k], F[D, k] = 1.0 / widths[k], change[k]
    inside = np.eye(D + 1) + F @ covariance @ F.T
    Q = F.T @ np.linalg.inv(inside) @ F
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

    Raises:
        ConfigError: a field is no array of numbers, target and widths are not (D,), or a width is not positive.
    """

    target: Array
    widths: Array

    def __post_init__(self) -> None:
        """Make each field an array of double precision, and refuse what cannot be."""
        for each in fields(self):
            object.__setattr__(self, each.name, _as_numbers(type(self), each.name, getattr(self, each.name)))
        if self.target.ndim != 1 or self.target.shape != self.widths.shape:
            raise ConfigError(
                f"{type(self).__name__} has a target of shape {self.target.shape} and widths of shape "
                f"{self.widths.shape}; expected is one number of each for each of the D channels: (D,)."
            )
        if not (self.widths > 0.0).all():
            raise ConfigError(
                f"{type(self).__name__} has the widths {self.widths.tolist()}; expected are positive numbers, infinite "
                "where a channel costs nothing."
            )

    @property
    def curvature(self) -> Array:
        """P (D, D), so that near the target c(x) is about ½ (x - target)ᵀP(x - target): what regulators minimise."""
        return np.diag(self.widths**-2.0)

    def with_widths(self, widths: Array, change: float) -> "Cost":
        """The same cost with other widths; and that of changes of the command, if they cost, times `change`."""
        return replace(self, widths=widths)

    @classmethod
    def over(
        cls,
        channels: Sequence[str],
        widths: Mapping[str, float],
        command_width: float | None,
        torque_limit: float,
        **further: float,
    ) -> "Cost":
        """This cost over named channels.

        Args:
            channels, widths, command_width, torque_limit: as of `cost_over`.
            further: values of further fields by name; each becomes an array of shape ().

        Raises:
            ConfigError: as of `cost_over`; or the class has no such field, or one more that needs a value.
        """
        target, found = _target_and_widths(channels, widths, command_width, torque_limit)
        _check_further(cls, further)
        return cls(target, found, **{name: _as_numbers(cls, name, value) for name, value in further.items()})

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


@made_once
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
    """c(x) = 1 - exp(-½ dᵀPd) with d = x - target and dᵀPd = Σ_k (d_k / width_k)² + (changeᵀd)².

    Eq. 11, where the paper has one width a for all channels and no price on changes of the command.

    Attributes:
        target: (D,).
        widths: (D,) in the channels' units; infinite where a channel costs nothing.
        change: (D,) weights whose sum with the channels costs, too: those of command_1 - command_2; zero, or
            none, costs nothing.
    """

    change: Array = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.change.shape == (0,):
            object.__setattr__(self, "change", np.zeros(len(self.widths)))
        if self.change.shape != self.widths.shape:
            raise ConfigError(
                f"{type(self).__name__} has a change of shape {self.change.shape}; expected is that of its widths, "
                f"{self.widths.shape}."
            )

    @property
    def curvature(self) -> Array:
        """P (D, D)."""
        return np.diag(self.widths**-2.0) + np.outer(self.change, self.change)

    def with_widths(self, widths: Array, change: float) -> "SaturatingCost":
        """The same cost with other widths; and that of changes of the command times `change`."""
        return replace(self, widths=widths, change=self.change / change)

    def at(self, state: Array) -> float:
        """c of one state."""
        distance = change = 0.0
        for k in range(len(state)):
            distance += ((state[k] - self.target[k]) * (1.0 / self.widths[k])) ** 2
            change += (state[k] - self.target[k]) * self.change[k]
        return float(-np.expm1(-0.5 * (distance + change**2)))

    def expected_at(self, mean: Array, covariance: Array) -> ExpectedCost:
        """E[c(x)], in closed form."""
        return expected_cost(self.target, self.widths, self.change, mean, covariance)

    def __call__(self, states: Array) -> Array:
        """c of all states at once."""
        gaps = states - self.target
        cost: Array = -np.expm1(-0.5 * (((gaps / self.widths) ** 2).sum(axis=-1) + (gaps @ self.change) ** 2))
        return cost


def cost_over(
    channels: Sequence[str],
    widths: Mapping[str, float],
    command_width: float | None,
    torque_limit: float,
    command_change_width: float | None = None,
) -> SaturatingCost:
    """The saturating cost over named channels, with its target at zero.

    Args:
        channels: of the state, D names.
        widths: by channel name, in the channel's unit; channels without one cost nothing.
        command_width: of `command_1`, the action's price, as a share of the torque limit; None costs nothing.
        torque_limit: [N·m].
        command_change_width: of `command_1 - command_2`, likewise; None, or a state without them, costs nothing.

    Raises:
        ConfigError: a width is not positive, or nothing has a price.
    """
    target, found = _target_and_widths(channels, widths, command_width, torque_limit)
    change = np.zeros(len(found))
    if command_change_width is not None and "command_2" in channels:
        if not command_change_width > 0:
            raise ConfigError(f"command_change_width must be positive; found {command_change_width}.")
        weight = 1.0 / (command_change_width * torque_limit)
        change[channels.index("command_1")], change[channels.index("command_2")] = weight, -weight
    return SaturatingCost(target, found, change)


def _check_further(kind: type[Cost], further: Mapping[str, float]) -> None:
    """Raise ConfigError where values of further fields are not those that a cost has."""
    own = {each.name: each for each in fields(kind) if each.name not in ("target", "widths")}
    for name in further:
        if name not in own:
            also = f"; it has {', '.join(own)}" if own else ""
            raise ConfigError(
                f"{kind.__name__} has no field {name!r} beside target and widths{also}. Take {name} out of the "
                f"settings of the cost, or add the line `{name}: Array` to the class, in the module {kind.__module__}."
            )
    needed = [name for name, each in own.items() if each.default is MISSING and each.default_factory is MISSING]
    if absent := [name for name in needed if name not in further]:
        raise ConfigError(
            f"{kind.__name__} lacks {', '.join(absent)}: add {', '.join(f'`{name}: <number>`' for name in absent)} to "
            "the settings of the cost, beside its _target_."
        )


def _as_numbers(kind: type[Cost], name: str, value: Any) -> Array:
    """A field of a cost as an array of double precision; the same one where it is that already."""
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ConfigError(
            f"{name} of {kind.__name__} must be a number or an array of numbers; found {value!r:.80}."
        ) from error


def _target_and_widths(
    channels: Sequence[str], widths: Mapping[str, float], command_width: float | None, torque_limit: float
) -> tuple[Array, Array]:
    """The target (D,), zero, and the widths (D,).

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
    return np.zeros(len(found)), found
