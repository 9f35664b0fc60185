"""Where a policy search begins."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum, auto
from typing import NamedTuple

import numpy as np

from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array
from twbal.core.streams import Stream, generator
from twbal.policies.linear import LinearPolicy
from twbal.policies.rbf import RbfPolicy
from twbal.search.linear_starts import SQUASH_SLOPE, linear_law, regulator, slopes
from twbal.search.robust import RankedPolicy
from twbal.search.task import Task

_NETWORKS = 4  # random ones on top of a regulator


@dataclass(frozen=True)
class PolicyParametrisation:
    """What the searched policies look like.

    Attributes:
        basis: number N of radial basis functions.
        linear: whether a linear part stands beside them; the paper has none.
        scale: by channel name, the size of a usual deviation: centres and length-scales start at that scale.
        command_scale: the same for past commands, as a share of the torque limit.
        weight_sd: of the random starting weights, in units of the activation.
    """

    basis: int
    linear: bool
    scale: dict[str, float]
    command_scale: float
    weight_sd: float

    def scales(self, names: Sequence[str], torque_limit: float) -> Array:
        """Scale of each channel, (D,).

        Raises:
            ConfigError: a channel has none.
        """
        past = self.command_scale * torque_limit
        known = {**{name: past for name in names if name.startswith("command_")}, **self.scale}
        missing = [n for n in names if n not in known]
        if missing:
            raise ConfigError(f"policy.scale has no entry for {missing[0]}; it has: {', '.join(self.scale)}.")
        return np.array([known[n] for n in names])


class StartKind(Enum):
    """Where a start comes from."""

    REGULATOR = auto()
    ROBUST = auto()
    EARLIER = auto()
    RANDOM = auto()


class Family(NamedTuple):
    """Starts that are much alike.

    Attributes:
        kind: where they come from.
        number: of the model whose regulators they are, or of the earlier policy.
    """

    kind: StartKind
    number: int = 0


class Start(NamedTuple):
    """One start.

    Attributes:
        origin: where it comes from, for the report.
        policy: the policy itself.
        family: that it is of.
    """

    origin: str
    policy: RbfPolicy
    family: Family


def linear_policy(
    shape: PolicyParametrisation, channels: Sequence[str], torque_limit: float, gain: Array, rng: np.random.Generator
) -> RbfPolicy:
    """A policy that is about u = -gain·x near the origin, with small random basis functions on top.

    Without a linear part, the basis functions imitate it: their weights are fitted to it over their own support.
    """
    policy = _with_network(shape, linear_law(tuple(channels), gain, torque_limit, 0.0), rng)
    policy = replace(policy, weights=shape.weight_sd * rng.standard_normal(shape.basis))
    return policy if shape.linear else _imitated(shape, policy, rng)


def _with_network(shape: PolicyParametrisation, law: RbfPolicy, rng: np.random.Generator) -> RbfPolicy:
    """A linear law with basis functions beside it, whose weights are zero."""
    s = shape.scales(law.channels, law.max_command)
    centres = rng.standard_normal((shape.basis, len(s))) * s
    return replace(law, centres=centres, weights=np.zeros(shape.basis), lengths=np.sqrt(3.0 * len(s)) / 2.0 * s)


def _imitated(shape: PolicyParametrisation, policy: RbfPolicy, rng: np.random.Generator) -> RbfPolicy:
    """A policy whose basis functions do what its linear part did, as far as they can."""
    places = rng.standard_normal((20 * shape.basis, len(policy.gain))) * shape.scales(
        policy.channels, policy.max_command
    )
    gaps = (places[:, None, :] - policy.centres) / policy.lengths
    features = np.exp(-0.5 * (gaps**2).sum(axis=-1))  # (20 N, N)
    ridge = 1e-3 * np.eye(shape.basis)
    fitted = np.linalg.solve(features.T @ features + ridge, features.T @ (places @ policy.gain))
    return replace(policy, weights=fitted, gain=np.zeros_like(policy.gain))


def robust_start(shape: PolicyParametrisation, found: RankedPolicy, seed: int) -> Start:
    """A regulator for robots of the parameter distribution, with a network beside it whose weights are zero."""
    beside = _with_network(shape, found.policy, generator(Stream.SEARCH_STARTS, seed, 1))
    return Start(found.origin, beside, Family(StartKind.ROBUST))


def earlier_start(earlier: Sequence[RbfPolicy]) -> Start:
    """The newest of the earlier policies, as it is."""
    newest = len(earlier) - 1
    return Start(f"policy {newest}", earlier[newest], Family(StartKind.EARLIER, newest))


def starting_policies(
    task: Task,
    shape: PolicyParametrisation,
    torque_limit: float,
    earlier: Sequence[RbfPolicy],
    rng: np.random.Generator,
) -> list[Start]:
    """All starts: regulators of each model's slopes, earlier policies at several strengths, and one random policy.

    Of the task's settings, `linearisation_amplitudes` are half widths of the command's secant and `lqr_command_widths`
    prices of the command for the regulator, both as shares of the torque limit; `gain_scales` are strengths at which
    each earlier policy is tried, as a robot stronger than its model wants less.

    Args:
        task: what the policy is for.
        shape: of the policy.
        torque_limit: [N·m].
        earlier: policies of earlier iterations, oldest first.
        rng: draws the networks.
    """
    settings, names = task.settings, task.models[0].names
    s = shape.scales(names, torque_limit)
    starts: list[Start] = []
    for number, model in enumerate(task.models):
        regulated = "regulator" if len(task.models) == 1 else f"regulator of model {number}"
        for swing in settings.linearisation_amplitudes:
            A, B = slopes(model, swing * torque_limit, s)
            for width in settings.lqr_command_widths:
                gain = regulator(A, B, task.cost, width * torque_limit)
                if gain is not None:
                    origin = f"{regulated} (swing {swing:g}, width {width:g})"
                    policy = linear_policy(shape, names, torque_limit, gain, rng)
                    starts.append(Start(origin, policy, Family(StartKind.REGULATOR, number)))
    for index, policy in enumerate(earlier):
        for share in settings.gain_scales:
            scaled = replace(policy, weights=share * policy.weights, gain=share * policy.gain, bias=share * policy.bias)
            starts.append(Start(f"policy {index} x {share:g}", scaled, Family(StartKind.EARLIER, index)))
    policy = linear_policy(shape, names, torque_limit, np.zeros(len(s)), rng)
    starts.append(Start("random", policy, Family(StartKind.RANDOM)))
    return starts


def starts_on(
    base: LinearPolicy,
    names: Sequence[str],
    shape: PolicyParametrisation,
    torque_limit: float,
    earlier: Sequence[RbfPolicy],
    rng: np.random.Generator,
) -> list[Start]:
    """Starts of a search for a network on top of the regulator u = u_0 - Kx: random ones, and earlier policies.

    Args:
        base: the regulator.
        names: of the channels.
        shape: of the network.
        torque_limit: [N·m].
        earlier: policies of earlier iterations, on the same regulator.
        rng: draws the networks.
    """
    beside = replace(shape, linear=True)
    networks = [linear_policy(beside, names, torque_limit, base.gain, rng) for _ in range(_NETWORKS)]
    bias = base.bias / (SQUASH_SLOPE * torque_limit)
    return [
        *(Start("network", replace(policy, bias=bias), Family(StartKind.RANDOM)) for policy in networks),
        *(Start(f"policy {i} x 1", policy, Family(StartKind.EARLIER, i)) for i, policy in enumerate(earlier)),
    ]
