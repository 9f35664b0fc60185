"""Functions drawn from a posterior with any kernel: pathwise conditioning, as in `models.function_samples`."""

from dataclasses import dataclass
from typing import Self

import numpy as np
import torch

from twbal.models.kernels.kernel_process import KernelProcess
from twbal.models.kernels.prior import PriorFunctions, draw_prior


@dataclass(frozen=True, eq=False)
class KernelSamples:
    """P functions with E outputs each, that PyTorch can differentiate.

    Attributes:
        process: the posterior.
        prior: functions from its prior, of scaled inputs and targets.
        corrections: (E, P, centres) weights of the data's part.
    """

    process: KernelProcess
    prior: PriorFunctions
    corrections: torch.Tensor

    @classmethod
    def draw(cls, process: KernelProcess, count: int, features: int, rng: np.random.Generator) -> Self:
        """Draw `count` functions; see `draw_prior` about `features`."""
        E, n = process.weights.shape
        with torch.no_grad():
            prior = draw_prior(process.module, process.scaled_centres, count, features, rng)
            before = prior.at(process.scaled_centres).numpy() * process.target_scales[:, None, None]  # (E, n, P)
        deviations = rng.standard_normal((E, n, count))
        roots = np.array([process.root(a) for a in range(E)])
        corrections = process.weights[:, :, None] - process.variance_matrix @ before + roots @ deviations
        return cls(process, prior, torch.tensor(corrections.transpose(0, 2, 1).copy()))

    def __call__(self, inputs: torch.Tensor) -> torch.Tensor:
        """Function i at input i, (P, E), for inputs (P, d)."""
        before = self.prior.each(inputs / self.process.tensors[0]) * torch.tensor(self.process.target_scales)
        return before + torch.einsum("epn,epn->pe", self.process.cross(inputs), self.corrections)
