"""The expected long-term cost by Monte Carlo: particles in place of moment matching.

Every particle is a robot of its own, with one g drawn from the posterior and noise drawn beforehand, the same for
every policy (common random numbers, as in PEGASUS: Ng and Jordan 2000). The cost is then an ordinary function of the
policy's parameters, and PyTorch differentiates it. No distribution is taken to be normal.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import torch

from twbal.core.compiled import kernel
from twbal.core.cost import Cost, CostNumbers, expected_price
from twbal.core.gaussian import Array, Gaussian
from twbal.core.streams import Stream, generator
from twbal.models.dynamics import DynamicsModel
from twbal.policies.rbf import RbfPolicy
from twbal.search.long_term_cost import LongTermCost
from twbal.search.sampled_rollouts import Draws
from twbal.search.torch_functions import Function, sampled_functions
from twbal.search.torch_robots import Robots
from twbal.search.transition import PolicyGradient


@dataclass(frozen=True)
class ParticleObjective:
    """What is minimised: the mean long-term cost of particles, and a little of the weights' size.

    Attributes:
        model: of the dynamics; f's variance is left out.
        cost: of a state.
        start: distribution of x_0.
        horizon: H [control periods].
        particles: P.
        features: random features of each particle's g.
        seed: of all that is drawn.
        weight_penalty: as of `Objective`.
    """

    model: DynamicsModel
    cost: Cost
    start: Gaussian
    horizon: int
    particles: int
    features: int
    seed: int
    weight_penalty: float

    def value(self, policy: RbfPolicy) -> float:
        """The long-term cost alone; infinite where it cannot be computed."""
        found = self.cost_of(policy, gradient=False)
        return found.value if np.isfinite(found.value) else np.inf

    def cost_of(self, policy: RbfPolicy, gradient: bool) -> LongTermCost:
        """The long-term cost without the penalty."""
        parts = [torch.tensor(p) for p in (policy.centres, policy.weights, policy.lengths, policy.gain)]
        for part in parts:
            part.requires_grad_(gradient)
        with torch.set_grad_enabled(gradient):
            numbers = self.cost.numbers
            value = torch.zeros(())
            for states in self._robots.states(_law(parts, policy)):
                value = value + _Price.apply(states, numbers).mean()  # type: ignore[no-untyped-call]
        if gradient:
            value.backward()  # type: ignore[no-untyped-call]
        slopes = [np.zeros(tuple(p.shape)) if p.grad is None else p.grad.numpy() for p in parts]
        return LongTermCost(value.item(), PolicyGradient(*slopes), 0)

    def distributions(self, policy: RbfPolicy) -> list[Gaussian]:
        """Mean and covariance of the particles at t = 1..H."""
        parts = [torch.tensor(p) for p in (policy.centres, policy.weights, policy.lengths, policy.gain)]
        with torch.no_grad():
            reached = [states.numpy() for states in self._robots.states(_law(parts, policy))]
        return [Gaussian(states.mean(axis=0), np.cov(states.T)) for states in reached]

    @cached_property
    def _robots(self) -> Robots:
        rng = generator(Stream.PARTICLES, self.seed, self.particles)
        model, n, H = self.model, self.particles, self.horizon
        D, measured = len(model.names), list(model.measured)
        g = sampled_functions(model.g, n, self.features, rng) if model.g else None
        sensors = np.zeros((H, n, D))
        sensors[:, :, measured] = np.sqrt(model.observation_noise) * rng.standard_normal((H, n, len(measured)))
        process = np.sqrt(model.process_noise) * rng.standard_normal((H, n, len(measured)))
        return Robots.of(model, g, Draws(self.start.sample(n, rng), sensors, process))


class _Price(torch.autograd.Function):
    """The cost of states (P, D), and its slope."""

    @staticmethod
    def forward(ctx: Any, states: torch.Tensor, numbers: CostNumbers) -> torch.Tensor:
        """Costs (P,)."""
        costs, slopes = _prices(numbers, np.ascontiguousarray(states.detach().numpy()))
        ctx.save_for_backward(torch.from_numpy(slopes))
        return torch.from_numpy(costs)

    @staticmethod
    def backward(ctx: Any, by_costs: torch.Tensor) -> tuple[torch.Tensor, None]:
        """Chain rule."""
        return by_costs[:, None] * ctx.saved_tensors[0], None


@kernel()
def _prices(cost: CostNumbers, states: Array) -> tuple[Array, Array]:
    costs, slopes = np.empty(len(states)), np.empty(states.shape)
    known = np.zeros((states.shape[1], states.shape[1]))
    for i in range(len(states)):
        found = expected_price(cost, states[i], known)
        costs[i], slopes[i] = found.value, found.by_mean
    return costs, slopes


def _law(parts: list[torch.Tensor], policy: RbfPolicy) -> Function:
    """Commands [N·m] of states, by the parts of an `RbfPolicy` and what of it stays as it is."""
    compensation, width = policy.compensation, policy.compensation_width
    return lambda states: policy.max_command * _squash(policy.bias + _activation(states, *parts), compensation, width)


def _activation(
    states: torch.Tensor, centres: torch.Tensor, weights: torch.Tensor, lengths: torch.Tensor, gain: torch.Tensor
) -> torch.Tensor:
    """As `RbfPolicy.activation`, (P,)."""
    gaps = (states[:, None, :] - centres) / lengths
    return states @ gain + torch.exp(-0.5 * (gaps**2).sum(dim=-1)) @ weights


def _squash(activation: torch.Tensor, compensation: float, width: float) -> torch.Tensor:
    """As `twbal.policies.squash.squash`."""
    smooth = (9.0 * torch.sin(activation) + torch.sin(3.0 * activation)) / 8.0
    if compensation == 0.0:
        return smooth
    folded = torch.asin(torch.sin(activation).clamp(-1.0 + 1e-12, 1.0 - 1e-12))
    step = torch.erf(folded / (math.sqrt(2.0) * width))
    return (1.0 - compensation) * smooth + compensation * step
