"""Sparse posteriors with any kernel: Titsias' optimal one (2009), summed over samples a block at a time."""

from dataclasses import replace

import numpy as np
import scipy.linalg

from twbal.core.gaussian import Array
from twbal.models.bound import JITTER
from twbal.models.fit import GpFitResult
from twbal.models.fit_settings import FitSettings, PriorReference
from twbal.models.kernels.exact import fit_prior
from twbal.models.kernels.kernel_process import KernelProcess
from twbal.models.kernels.torch_threads import one_thread
from twbal.models.sparse import SparseSettings, greedy_choice, random_subset

_BLOCK = 2000  # samples whose covariances with the inducing inputs are in memory at once


def fit_induced(
    inputs: Array, targets: Array, kernel: str, settings: SparseSettings, seed: int, reference: PriorReference | None
) -> GpFitResult:
    """As `models.sparse.fit_sparse_gp`; the parameters are those of the subset."""
    with one_thread():
        prior = fit_on_subset(inputs, targets, kernel, settings.subset, settings.fit, seed, reference)
        centres = choose_inducing(inputs, prior, settings.inducing, settings.tolerance)
        return GpFitResult(*condition_induced(inputs, targets, centres, prior))


def fit_on_subset(
    inputs: Array,
    targets: Array,
    kernel: str,
    count: int,
    settings: FitSettings,
    seed: int,
    reference: PriorReference | None,
) -> KernelProcess:
    """The prior of an exact fit to `count` random samples of inputs (n, d) and targets (n, E)."""
    chosen = random_subset(len(inputs), count, seed)
    return fit_prior(inputs[chosen], targets[chosen], kernel, settings, seed, reference)


def choose_inducing(inputs: Array, prior: KernelProcess, count: int, tolerance: float) -> Array:
    """Rows of `inputs` (n, d) that leave the least variance unexplained; see `models.sparse.choose_inducing`."""
    process, variance = prior.over(inputs), prior.prior_variance(inputs)  # (E, n)
    top = variance.max(axis=1, keepdims=True)
    gain = 0.5 * top[:, 0] / prior.noise_variance

    def rows(pivot: int) -> Array:
        return np.asarray(np.concatenate(list(process.covariances(inputs[[pivot]]))) / top)

    return inputs[greedy_choice(rows, variance / top, gain, count, tolerance)]


def condition_induced(
    inputs: Array, targets: Array, centres: Array, prior: KernelProcess
) -> tuple[KernelProcess, Array]:
    """Sparse posterior of E GPs and its bound (E,) [nats]: inputs (n, d), targets (n, E), inducing inputs (m, d).

    With K_mm = LLᵀ and V = L⁻¹ K_mn: B = I + σ⁻² V Vᵀ, β = σ⁻² L⁻ᵀ B⁻¹ V y and W = L⁻ᵀ (I - B⁻¹) L⁻¹. V Vᵀ is kept as
    the triangular factor of a QR factorisation, which does not square its condition.
    """
    (n, E), m = targets.shape, len(centres)
    process = prior.over(centres)
    factors = [_factor(kernel) for kernel in process.covariances(centres)]
    triangles, projected, traces = np.zeros((E, m, m)), np.zeros((E, m)), np.zeros(E)
    for start in range(0, n, _BLOCK):
        block = inputs[start : start + _BLOCK]
        traces += process.prior_variance(block).sum(axis=1)
        for a, cross in enumerate(process.covariances(block)):
            whitened = scipy.linalg.solve_triangular(factors[a], cross.T, lower=True)  # (m, block)
            triangles[a] = np.linalg.qr(np.vstack([triangles[a], whitened.T]), mode="r")
            projected[a] += whitened @ targets[start : start + _BLOCK, a]
    parts, bounds = [], []
    for a, factor in enumerate(factors):
        noise = process.noise_variance[a]
        known = triangles[a].T @ triangles[a]  # V Vᵀ
        inner = scipy.linalg.cho_factor(np.eye(m) + known / noise, lower=True)
        inverse, mean = scipy.linalg.cho_solve(inner, np.eye(m)), scipy.linalg.cho_solve(inner, projected[a]) / noise
        back = scipy.linalg.solve_triangular(factor, np.eye(m), lower=True).T  # L⁻ᵀ
        matrix = back @ (np.eye(m) - inverse) @ back.T
        parts.append((back @ mean, 0.5 * (matrix + matrix.T), back @ inverse @ triangles[a].T / np.sqrt(noise)))
        fitted = (targets[:, a] @ targets[:, a] - projected[a] @ mean) / noise
        slack = (traces[a] - np.trace(known)) / noise
        determinant = 2.0 * np.log(np.diag(inner[0])).sum() + n * np.log(2.0 * np.pi * noise)
        bounds.append(-0.5 * (determinant + fitted + slack))
    weights, matrices, roots = map(np.array, zip(*parts, strict=True))
    return replace(process, weights=weights, variance_matrix=matrices, sample_root=roots), np.array(bounds)


def _factor(kernel: Array) -> Array:
    """L of K_mm (m, m) with jitter, (m, m)."""
    return np.linalg.cholesky(kernel + JITTER * kernel.diagonal().max() * np.eye(len(kernel)))
