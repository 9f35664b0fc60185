"""Where a policy search begins."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array
from twbal.policies.rbf import RbfPolicy
from twbal.search.linear_starts import regulator, slopes
from twbal.search.task import Task

_SQUASH_SLOPE = 1.5  # σ'(0) of eq. 10
_NETWORKS = 4  # random ones on top of a regulator


@dataclass(frozen=True)
class PolicyShape:
    """What the searched policies look like.

    Attributes:
        basis: number N of radial basis functions.
        linear: whether a linear part stands beside them; the paper has none.
        scale: by channel name, the size of a usual deviation: centres and length-scales start at that scale.
        past_command_scale: the same for past commands, as a share of the torque limit.
        weight_sd: of the random starting weights, in units of the activation.
    """

    basis: int
    linear: bool
    scale: dict[str, float]
    past_command_scale: float
    weight_sd: float

    def scales(self, names: Sequence[str], torque_limit: float) -> Array:
        """Scale of each channel, (D,).

        Raises:
            ConfigError: a channel has none.
        """
        past = self.past_command_scale * torque_limit
        known = {**{name: past for name in names if name.startswith("command_")}, **self.scale}
        missing = [n for n in names if n not in known]
        if missing:
            raise ConfigError(f"policy.scale has no entry for {missing[0]}; it has: {', '.join(self.scale)}.")
        return np.array([known[n] for n in names])


class Start(NamedTuple):
    """One start.

    Attributes:
        origin: where it comes from, for the report.
        policy: the policy itself.
        family: the same for starts that differ in strength or price alone.
    """

    origin: str
    policy: RbfPolicy
    family: str


def linear_policy(
    shape: PolicyShape, channels: Sequence[str], torque_limit: float, gain: Array, rng: np.random.Generator
) -> RbfPolicy:
    """A policy that is about u = -gain·x near the origin, with small random basis functions on top.

    Without a linear part, the basis functions imitate it: their weights are fitted to it over their own support.
    """
    s = shape.scales(channels, torque_limit)
    D = len(s)
    activation_gain = -gain / (torque_limit * _SQUASH_SLOPE)
    centres = rng.standard_normal((shape.basis, D)) * s
    lengths = np.sqrt(3.0 * D) / 2.0 * s
    weights = shape.weight_sd * rng.standard_normal(shape.basis)
    policy = RbfPolicy(tuple(channels), centres, weights, lengths, activation_gain, torque_limit)
    if shape.linear:
        return policy
    places = rng.standard_normal((20 * shape.basis, D)) * s
    gaps = (places[:, None, :] - centres) / lengths
    features = np.exp(-0.5 * (gaps**2).sum(axis=-1))  # (20 N, N)
    ridge = 1e-3 * np.eye(shape.basis)
    fitted = np.linalg.solve(features.T @ features + ridge, features.T @ (places @ activation_gain))
    return replace(policy, weights=fitted, gain=np.zeros(D))


def starting_policies(
    task: Task, shape: PolicyShape, torque_limit: float, earlier: Sequence[RbfPolicy], rng: np.random.Generator
) -> list[Start]:
    """All starts: regulators of each model's slopes, earlier policies at several strengths, and one random policy.

    Of the task's settings, `swings` are half widths of the command's secant and `command_widths` prices of the command
    for the regulator, both as shares of the torque limit; `shares` are strengths at which each earlier policy is tried,
    as a robot stronger than its model wants less.

    Args:
        task: what the policy is for.
        shape: of the policy.
        torque_limit: [N·m].
        earlier: policies of earlier iterations, oldest first.
        rng: draws the networks.
    """
    settings, names = task.settings, task.models[0].channels.names
    s = shape.scales(names, torque_limit)
    starts: list[Start] = []
    for number, model in enumerate(task.models):
        regulated = "regulator" if len(task.models) == 1 else f"regulator of model {number}"
        for swing in settings.swings:
            A, B = slopes(model, swing * torque_limit, s)
            for width in settings.command_widths:
                gain = regulator(A, B, task.cost, width * torque_limit)
                if gain is not None:
                    origin = f"{regulated} (swing {swing:g}, width {width:g})"
                    starts.append(Start(origin, linear_policy(shape, names, torque_limit, gain, rng), regulated))
    for index, policy in enumerate(earlier):
        for share in settings.shares:
            scaled = replace(policy, weights=share * policy.weights, gain=share * policy.gain)
            starts.append(Start(f"policy {index} x {share:g}", scaled, f"policy {index}"))
    starts.append(Start("random", linear_policy(shape, names, torque_limit, np.zeros(len(s)), rng), "random"))
    return starts


def starts_on(
    gain: Array,
    names: Sequence[str],
    shape: PolicyShape,
    torque_limit: float,
    earlier: Sequence[RbfPolicy],
    rng: np.random.Generator,
) -> list[Start]:
    """Starts of a search for a network on top of the regulator u = -Kx: random ones, and earlier policies.

    Args:
        gain: K (D,) [N·m / unit of each channel].
        names: of the channels.
        shape: of the network.
        torque_limit: [N·m].
        earlier: policies of earlier iterations, on the same regulator.
        rng: draws the networks.
    """
    beside = replace(shape, linear=True)
    fresh = [linear_policy(beside, names, torque_limit, gain, rng) for _ in range(_NETWORKS)]
    again = [Start(f"policy {index} x 1", policy, f"policy {index}") for index, policy in enumerate(earlier)]
    return [*(Start("network", policy, "network") for policy in fresh), *again]
