"""Titsias' lower bound on the log evidence of one GP with inducing inputs, its gradient and its posterior."""

from typing import NamedTuple

import numpy as np
import scipy.linalg

from twbal.core.gaussian import Array
from twbal.models.gp import squared_exponential

JITTER = 1e-8  # relative to α²; two inducing inputs may nearly coincide


class InducedPosterior(NamedTuple):
    """Posterior of one output: mean k(x, Z) β and variance α² - k(x, Z) W k(Z, x).

    Attributes:
        weights: (m,), β = σ⁻² A⁻¹ K_mn y with A = K_mm + σ⁻² K_mn K_nm.
        variance_matrix: (m, m), W = K_mm⁻¹ - A⁻¹.
        sample_root: (m, m), R with R Rᵀ = W - W K_mm W, which is σ⁻² A⁻¹ K_mn K_nm A⁻¹.
        bound: on the log evidence [nats].
    """

    weights: Array
    variance_matrix: Array
    sample_root: Array
    bound: float


class _Factors(NamedTuple):
    kernel: Array  # (m, m), K_mm with jitter
    cross: Array  # (m, n), K_mn
    root_inverse: Array  # (m, m), L⁻¹ of K_mm = LLᵀ
    whitened: Array  # (m, n), V = L⁻¹ K_mn
    gram: Array  # (m, m), V Vᵀ
    inner_inverse: Array  # (m, m), B⁻¹ of B = I + σ⁻² L⁻¹ K_mn K_nm L⁻ᵀ
    weights: Array  # (m,), β
    residual: Array  # (n,), y - K_nm β
    slack: float  # tr(K_nn - Q)
    bound: float  # [nats]


class Bound:
    """The bound log N(y | 0, Q + σ²I) - tr(K_nn - Q)/(2σ²) with Q = K_nm K_mm⁻¹ K_mn (Titsias 2009, eq. 9).

    Its coordinates θ are those of `Evidence`; the inducing inputs stay where they are.
    """

    def __init__(self, inputs: Array, target: Array, centres: Array) -> None:
        """Keep the data of one output: inputs (n, d), target (n,), inducing inputs (m, d)."""
        shift = inputs.mean(axis=0)
        self._inputs, self._target, self._centres = inputs - shift, target, centres - shift

    def __call__(self, theta: Array) -> tuple[float, Array]:
        """The bound [nats] and its gradient (d + 2,) at `theta` (d + 2,)."""
        n = len(self._target)
        noise = np.exp(2.0 * theta[-1])
        signal = noise * np.exp(2.0 * theta[-2])
        f = self._factors(theta)
        inner = np.eye(len(f.kernel)) - f.inner_inverse
        by_cross = f.root_inverse.T @ inner @ f.whitened  # (K_mm⁻¹ - A⁻¹) K_mn
        for row, weight, covariances in zip(by_cross, f.weights, f.cross, strict=True):  # in the processor's cache
            row += weight * f.residual
            row *= covariances / noise
        by_kernel = f.root_inverse.T @ (inner - f.gram / noise) @ f.root_inverse
        by_kernel -= np.outer(f.weights, f.weights)
        by_kernel *= 0.5 * f.kernel
        scales = _by_log_length_scales(by_cross, self._centres, self._inputs) / np.exp(2.0 * theta[:-2])
        scales += _by_log_length_scales(by_kernel, self._centres, self._centres) / np.exp(2.0 * theta[:-2])
        by_signal = 2.0 * (by_cross.sum() + by_kernel.sum()) - n * signal / noise  # by log α
        explained = np.trace(inner)  # n - σ² tr (Q + σ²I)⁻¹
        by_noise = explained - n + (f.residual @ f.residual + f.slack) / noise  # by log σ
        return f.bound, np.concatenate([scales, [by_signal, by_signal + by_noise]])

    def posterior(self, theta: Array) -> InducedPosterior:
        """The posterior at `theta` (d + 2,)."""
        f = self._factors(theta)
        inner = np.eye(len(f.kernel)) - f.inner_inverse
        matrix = f.root_inverse.T @ inner @ f.root_inverse
        # L⁻¹ K_mn K_nm L⁻ᵀ = knownᵀ known, without squaring its condition
        known: Array = np.asarray(np.linalg.qr(f.whitened.T, mode="r"))
        root = np.zeros_like(f.kernel)
        root[:, : len(known)] = f.root_inverse.T @ f.inner_inverse @ known.T / np.exp(theta[-1])
        return InducedPosterior(f.weights, 0.5 * (matrix + matrix.T), root, f.bound)

    def _factors(self, theta: Array) -> _Factors:
        noise = np.exp(2.0 * theta[-1])
        signal, length_scales = noise * np.exp(2.0 * theta[-2]), np.exp(theta[:-2])
        kernel = signal * squared_exponential(self._centres, self._centres, length_scales)
        kernel[np.diag_indices_from(kernel)] = signal * (1.0 + JITTER)
        cross = squared_exponential(self._centres, self._inputs, length_scales)
        cross *= signal
        identity = np.eye(len(kernel))
        root_inverse = scipy.linalg.solve_triangular(np.linalg.cholesky(kernel), identity, lower=True)
        whitened = root_inverse @ cross
        gram = whitened @ whitened.T
        factor = scipy.linalg.cho_factor(identity + gram / noise, lower=True)
        inner_inverse = scipy.linalg.cho_solve(factor, identity)
        n, y = len(self._target), self._target
        weights = root_inverse.T @ scipy.linalg.cho_solve(factor, whitened @ y) / noise
        residual, slack = y - weights @ cross, n * signal - np.trace(gram)
        log_determinant = 2.0 * np.log(np.diag(factor[0])).sum()
        bound = -0.5 * (n * np.log(2.0 * np.pi * noise) + float(log_determinant) + (y @ residual + slack) / noise)
        return _Factors(
            kernel, cross, root_inverse, whitened, gram, inner_inverse, weights, residual, slack, float(bound)
        )


def _by_log_length_scales(weighted: Array, left: Array, right: Array) -> Array:
    """Σ_ij M_ij (a_ik - b_jk)², (d,), for M (m, n) between rows of (m, d) and (n, d)."""
    crossed = np.einsum("mk,mk->k", left, weighted @ right)
    return np.asarray(weighted.sum(axis=1) @ left**2 + weighted.sum(axis=0) @ right**2 - 2.0 * crossed)
