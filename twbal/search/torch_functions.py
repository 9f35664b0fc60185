"""GP posteriors as functions that PyTorch can differentiate: their means, and functions drawn from them."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import torch

from twbal.models.function_samples import FunctionSamples
from twbal.models.gp import GaussianProcess, Posterior

if TYPE_CHECKING:
    from twbal.models.kernels.kernel_process import KernelProcess

Function = Callable[[torch.Tensor], torch.Tensor]
"""Of inputs (P, d), with values (P, E)."""


def mean_function(gp: Posterior) -> Function:
    """The posterior mean."""
    if isinstance(gp, GaussianProcess):
        return _Mean(gp)
    return _any_kernel(gp).mean_tensor


def sampled_functions(gp: Posterior, count: int, features: int, rng: np.random.Generator) -> Function:
    """`count` functions drawn from a posterior, as one of `count` inputs: function i at input i.

    Args:
        gp: the posterior.
        count: P.
        features: random features of each function; see `models.kernels.prior.draw_prior`.
        rng: draws them.
    """
    if isinstance(gp, GaussianProcess):
        return SampledFunctions(FunctionSamples.draw(gp, count, features, rng))
    from twbal.models.kernels.samples import KernelSamples  # here, as GPyTorch takes a while to import

    return KernelSamples.draw(_any_kernel(gp), count, features, rng)


class _Kernels:
    """The squared exponential kernel between inputs and a GP's centres."""

    def __init__(self, gp: GaussianProcess) -> None:
        self._scaled = [torch.tensor(gp.centres / lengths) for lengths in gp.length_scales]
        self._lengths = torch.tensor(gp.length_scales)

    def correlation(self, inputs: torch.Tensor, output: int) -> torch.Tensor:
        """(P, n) of one output."""
        a, b = inputs / self._lengths[output], self._scaled[output]
        exponent = a @ b.T - 0.5 * (a * a).sum(dim=1)[:, None] - 0.5 * (b * b).sum(dim=1)
        return torch.exp(exponent.clamp(max=0.0))


class _Mean:
    """A GP's mean."""

    def __init__(self, gp: GaussianProcess) -> None:
        self._kernels = _Kernels(gp)
        self._weights = torch.tensor(gp.weights * gp.signal_variance[:, None])

    def __call__(self, inputs: torch.Tensor) -> torch.Tensor:
        """(P, E)."""
        pairs = enumerate(self._weights)
        return torch.stack([self._kernels.correlation(inputs, a) @ weights for a, weights in pairs], dim=1)


class SampledFunctions:
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


def _any_kernel(gp: Posterior) -> "KernelProcess":
    from twbal.models.kernels.kernel_process import KernelProcess  # here, as GPyTorch takes a while to import

    if not isinstance(gp, KernelProcess):
        raise TypeError(f"A posterior is a GaussianProcess or a KernelProcess; found a {type(gp).__name__}.")
    return gp
