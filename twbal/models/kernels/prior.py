"""Functions drawn from the prior of a kernel, cheap to follow along a rollout.

By random Fourier features where the kernel's spectral density is known: waves cos(ωᵀx + φ) with ω drawn from it
(Rahimi and Recht 2007). It is normal for the SE kernel, Student-t with 2ν degrees of freedom for Matérn's, and a
gamma mixture of normals for the rational quadratic one; a product of kernels has sums of their ω. A linear kernel is
drawn as it is. Any other kernel is drawn at anchors, by a Cholesky factor, and interpolated between them: exact at the
anchors, and too smooth far from all of them.
"""

from dataclasses import dataclass
from typing import Protocol

import gpytorch.kernels as gk
import numpy as np
import torch

from twbal.core.errors import FitError
from twbal.core.gaussian import Array
from twbal.models.kernels.expression import DenseLinear

_JITTERS = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4)  # of the anchors' largest variance; the first that suffices is taken


class PriorFunctions(Protocol):
    """P functions of E outputs."""

    def at(self, places: torch.Tensor) -> torch.Tensor:
        """All functions at each place (n, d), (E, n, P)."""

    def each(self, places: torch.Tensor) -> torch.Tensor:
        """Function i at place i, (P, E), for places (P, d)."""


@dataclass(frozen=True, eq=False)
class Waves:
    """Σ_m w_m cos(ω_mᵀx + φ_m) + bᵀx.

    Attributes:
        frequencies: (E, M, d).
        phases: (E, M).
        weights: (E, M, P).
        slopes: b (E, d, P).
    """

    frequencies: torch.Tensor
    phases: torch.Tensor
    weights: torch.Tensor
    slopes: torch.Tensor

    def at(self, places: torch.Tensor) -> torch.Tensor:
        """All functions at each place (n, d), (E, n, P)."""
        return self._waves(places) @ self.weights + places @ self.slopes

    def each(self, places: torch.Tensor) -> torch.Tensor:
        """Function i at place i, (P, E), for places (P, d)."""
        straight = torch.einsum("pd,edp->pe", places, self.slopes)
        return torch.einsum("epm,emp->pe", self._waves(places), self.weights) + straight

    def _waves(self, places: torch.Tensor) -> torch.Tensor:
        return torch.cos(places @ self.frequencies.transpose(1, 2) + self.phases[:, None, :])


@dataclass(frozen=True, eq=False)
class Interpolated:
    """k(x, A) K(A, A)⁻¹ h(A).

    Attributes:
        kernel: of E outputs.
        anchors: A (q, d).
        weights: K⁻¹ h(A), (E, q, P).
    """

    kernel: gk.Kernel
    anchors: torch.Tensor
    weights: torch.Tensor

    def at(self, places: torch.Tensor) -> torch.Tensor:
        """All functions at each place (n, d), (E, n, P)."""
        values: torch.Tensor = self.kernel(places, self.anchors).to_dense() @ self.weights
        return values

    def each(self, places: torch.Tensor) -> torch.Tensor:
        """Function i at place i, (P, E), for places (P, d)."""
        return torch.einsum("epq,eqp->pe", self.kernel(places, self.anchors).to_dense(), self.weights)


def draw_prior(
    kernel: gk.Kernel, centres: torch.Tensor, count: int, features: int, rng: np.random.Generator
) -> PriorFunctions:
    """Draw `count` functions.

    Args:
        kernel: of E outputs, with nothing to learn.
        centres: (n, d) of the posterior; anchors are these and others spread around them.
        count: P.
        features: waves of each summand; or anchors beside the centres.
        rng: draws them.

    Raises:
        FitError: the covariance of the anchors is not positive definite, with the most jitter.
    """
    summands = kernel.kernels if isinstance(kernel, gk.AdditiveKernel) else [kernel]
    linear = [part for part in summands if isinstance(part.base_kernel, DenseLinear)]
    drawn = [(part, _frequencies(part.base_kernel, features, rng)) for part in summands if part not in linear]
    waves = [(part, found) for part, found in drawn if found is not None]
    if len(waves) < len(drawn):
        return _interpolated(kernel, centres, count, features, rng)
    (E,), d = kernel.batch_shape, centres.shape[1]
    slopes = np.zeros((E, d, count))
    for part in linear:
        sd = torch.sqrt(part.outputscale[:, None] * part.base_kernel.variance[:, 0, :]).numpy()  # (E, d)
        slopes += sd[:, :, None] * rng.standard_normal((E, d, count))
    M = features * len(waves)
    amplitudes = [np.sqrt(2.0 * part.outputscale.numpy() / features) for part, _ in waves]  # (E,) each
    weights = np.repeat(np.array(amplitudes).reshape(-1, E).T, features, axis=1)[:, :, None]
    frequencies = np.concatenate([np.zeros((E, 0, d)), *(found for _, found in waves)], axis=1)
    phases = rng.uniform(0.0, 2.0 * np.pi, (E, M))
    weights = weights * rng.standard_normal((E, M, count))
    return Waves(*map(torch.tensor, (frequencies, phases, weights, slopes)))


def _frequencies(kernel: gk.Kernel, count: int, rng: np.random.Generator) -> Array | None:
    """ω (E, M, d) from the spectral density of a kernel of variance 1; None where it is not known."""
    if isinstance(kernel, gk.ProductKernel):
        parts = [_frequencies(part, count, rng) for part in kernel.kernels]
        known = [part for part in parts if part is not None]
        return np.sum(known, axis=0) if len(known) == len(parts) else None
    mixing = {gk.RBFKernel: _normal, gk.MaternKernel: _student, gk.RQKernel: _gamma}.get(type(kernel))
    if mixing is None:
        return None
    lengths = kernel.lengthscale.numpy()  # (E, 1, d)
    normal = rng.standard_normal((len(lengths), count, lengths.shape[2]))
    return np.asarray(np.sqrt(mixing(kernel, count, rng)) * normal / lengths)


def _normal(_: gk.Kernel, count: int, rng: np.random.Generator) -> Array:
    return np.ones((1, count, 1))


def _student(kernel: gk.Kernel, count: int, rng: np.random.Generator) -> Array:
    freedom = 2.0 * float(kernel.nu)
    return np.asarray(freedom / rng.chisquare(freedom, (len(kernel.lengthscale), count, 1)))


def _gamma(kernel: gk.Kernel, count: int, rng: np.random.Generator) -> Array:
    shape = kernel.alpha.numpy()[:, :, None]  # (E, 1, 1)
    return np.asarray(rng.standard_gamma(np.broadcast_to(shape, (len(shape), count, 1))) / shape)


def _interpolated(
    kernel: gk.Kernel, centres: torch.Tensor, count: int, features: int, rng: np.random.Generator
) -> Interpolated:
    chosen = centres[torch.tensor(rng.integers(len(centres), size=features))]
    around = chosen + centres.std(dim=0, correction=0) * torch.tensor(rng.standard_normal(chosen.shape))
    anchors = torch.cat([centres, around])
    matrix = kernel(anchors, anchors).to_dense()
    normal = torch.tensor(rng.standard_normal((len(matrix), len(anchors), count)))
    return Interpolated(kernel, anchors, torch.linalg.solve_triangular(_root(matrix).mT, normal, upper=True))


def _root(matrix: torch.Tensor) -> torch.Tensor:
    """Lower Cholesky factors of the covariances of anchors (E, q, q), with as little jitter as they need."""
    top = matrix.diagonal(dim1=1, dim2=2).amax(dim=1)
    for jitter in _JITTERS:
        more = jitter * top[:, None, None] * torch.eye(matrix.shape[-1], dtype=torch.float64)
        root: torch.Tensor
        root, failed = torch.linalg.cholesky_ex(matrix + more)
        if not failed.any():
            return root
    raise FitError(
        f"Functions cannot be drawn from the kernel that was learned: its covariance of {matrix.shape[-1]} places is "
        f"not positive definite, with a jitter of {_JITTERS[-1]:g} either. Choose another model.kernel, or collect "
        "more rollouts."
    )
