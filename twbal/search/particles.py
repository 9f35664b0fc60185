"""The expected long-term cost by Monte Carlo: particles in place of moment matching.

Every particle is a robot of its own, with one g drawn from the posterior and noise drawn beforehand, the same for
every policy (common random numbers, as in PEGASUS: Ng and Jordan 2000). The cost is then an ordinary function of the
policy's parameters, and PyTorch differentiates it. No distribution is taken to be normal.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch

from twbal.core.cost import SaturatingCost
from twbal.core.gaussian import Gaussian
from twbal.core.streams import Stream, generator
from twbal.models.dynamics import DynamicsModel
from twbal.models.function_samples import FunctionSamples
from twbal.models.gp import GaussianProcess
from twbal.policies.rbf import RbfPolicy
from twbal.search.long_term_cost import LongTermCost
from twbal.search.transition import PolicyGradient

_FAR = 1e3
"""No channel of a falling robot is followed beyond this."""


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
    cost: SaturatingCost
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
            target, widths = torch.tensor(self.cost.target), torch.tensor(self.cost.widths)
            value = torch.zeros(())
            for states in self._courses(parts, policy.max_command):
                value = value - torch.expm1(-0.5 * (((states - target) / widths) ** 2).sum(dim=1)).mean()
        if gradient:
            value.backward()  # type: ignore[no-untyped-call]
        slopes = [np.zeros(tuple(p.shape)) if p.grad is None else p.grad.numpy() for p in parts]
        return LongTermCost(value.item(), PolicyGradient(*slopes), 0)

    def distributions(self, policy: RbfPolicy) -> list[Gaussian]:
        """Mean and covariance of the particles at t = 1..H."""
        parts = [torch.tensor(p) for p in (policy.centres, policy.weights, policy.lengths, policy.gain)]
        with torch.no_grad():
            courses = [states.numpy() for states in self._courses(parts, policy.max_command)]
        return [Gaussian(states.mean(axis=0), np.cov(states.T)) for states in courses]

    def _courses(self, policy: list[torch.Tensor], limit: float) -> Iterator[torch.Tensor]:
        """The particles (P, D) at t = 1..H."""
        draws = self._draws
        states = draws.start
        for noise, seeing in zip(draws.process, draws.sensors, strict=True):
            command = limit * _squash(_activation(states + seeing, *policy))
            inputs = torch.cat([states, command[:, None]], dim=1)
            change = _mean(draws.f, inputs) + noise
            if draws.g is not None:
                change = change + draws.g(inputs)
            states = (inputs @ draws.carry + change @ draws.selection).clamp(-_FAR, _FAR)
            yield states

    @cached_property
    def _draws(self) -> "_Draws":
        rng = generator(Stream.PARTICLES, self.seed, self.particles)
        model, n, H = self.model, self.particles, self.horizon
        D, measured = len(model.channels.names), list(model.channels.measured)
        samples = FunctionSamples.draw(model.g, n, self.features, rng) if model.g else None
        sensors = np.zeros((H, n, D))
        sensors[:, :, measured] = np.sqrt(model.observation_noise) * rng.standard_normal((H, n, len(measured)))
        process = np.sqrt(model.process_noise) * rng.standard_normal((H, n, len(measured)))
        return _Draws(
            start=torch.tensor(self.start.sample(n, rng)),
            process=torch.tensor(process),
            sensors=torch.tensor(sensors),
            f=_Kernels(model.f),
            g=_Functions(samples) if samples else None,
            carry=torch.tensor(model.transition_matrix.T.copy()),
            selection=torch.tensor(model.selection.T.copy()),
        )


class _Kernels:
    """A GP's mean in PyTorch."""

    def __init__(self, gp: GaussianProcess) -> None:
        self.scaled = [torch.tensor(gp.centres / lengths) for lengths in gp.length_scales]
        self.lengths = torch.tensor(gp.length_scales)
        self.weights = torch.tensor(gp.weights * gp.signal_variance[:, None])

    def correlation(self, inputs: torch.Tensor, output: int) -> torch.Tensor:
        """(P, n) of one output."""
        a, b = inputs / self.lengths[output], self.scaled[output]
        exponent = a @ b.T - 0.5 * (a * a).sum(dim=1)[:, None] - 0.5 * (b * b).sum(dim=1)
        return torch.exp(exponent.clamp(max=0.0))


def _mean(kernels: _Kernels, inputs: torch.Tensor) -> torch.Tensor:
    outputs = range(len(kernels.weights))
    return torch.stack([kernels.correlation(inputs, a) @ kernels.weights[a] for a in outputs], dim=1)


class _Functions:
    """`FunctionSamples` in PyTorch: function i at input i."""

    def __init__(self, samples: FunctionSamples) -> None:
        gp = samples.gp
        self._kernels = _Kernels(gp)
        self._frequencies, self._phases = torch.tensor(samples.frequencies), torch.tensor(samples.phases)
        self._features = torch.tensor(samples.features.transpose(0, 2, 1).copy())  # (E, P, M)
        corrections = samples.corrections * gp.signal_variance[:, None, None]
        self._corrections = torch.tensor(corrections.transpose(0, 2, 1).copy())  # (E, P, centres)

    def __call__(self, inputs: torch.Tensor) -> torch.Tensor:
        """(P, E)."""
        values = []
        for a in range(len(self._features)):
            waves = torch.cos(inputs @ self._frequencies[a].T + self._phases[a])
            near = self._kernels.correlation(inputs, a)
            values.append((waves * self._features[a]).sum(dim=1) + (near * self._corrections[a]).sum(dim=1))
        return torch.stack(values, dim=1)


@dataclass(frozen=True)
class _Draws:
    """All that is random, and the model, as tensors."""

    start: torch.Tensor  # (P, D)
    process: torch.Tensor  # (H, P, E)
    sensors: torch.Tensor  # (H, P, D)
    f: _Kernels
    g: _Functions | None
    carry: torch.Tensor  # (D + 1, D)
    selection: torch.Tensor  # (E, D)


def _activation(
    states: torch.Tensor, centres: torch.Tensor, weights: torch.Tensor, lengths: torch.Tensor, gain: torch.Tensor
) -> torch.Tensor:
    """As `RbfPolicy.activation`, (P,)."""
    gaps = (states[:, None, :] - centres) / lengths
    return states @ gain + torch.exp(-0.5 * (gaps**2).sum(dim=-1)) @ weights


def _squash(activation: torch.Tensor) -> torch.Tensor:
    return (9.0 * torch.sin(activation) + torch.sin(3.0 * activation)) / 8.0
