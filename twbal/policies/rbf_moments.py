"""Moments of a(y) = kᵀy + Σ_i w_i exp(-½ (y - c_i)ᵀΛ⁻¹(y - c_i)) at y ~ N(m, S), and the way back from them.

Exact, as sums over basis functions and their pairs. With ν_i = c_i - m and B = (S + Λ)⁻¹,
E[φ_i] = q_i = |SΛ⁻¹ + I|^(-1/2) exp(-½ ν_iᵀBν_i); with δ = (ν_i + ν_j) / 2 and W = (S + Λ/2)⁻¹,
E[φ_iφ_j] = |2SΛ⁻¹ + I|^(-1/2) exp(-¼ (c_i - c_j)ᵀΛ⁻¹(c_i - c_j) - ½ δᵀWδ). The variance is summed as q_iq_j
expm1(Δ_ij), which loses no digits where S is small.
"""

from typing import NamedTuple

import numpy as np

from twbal.core.compiled import kernel
from twbal.core.exponential import expm1_in_place
from twbal.core.gaussian import Array
from twbal.policies.squash import Compensation


class Network(NamedTuple):
    """The parameters of an `RbfPolicy`, as compiled code takes them; the same names and shapes.

    Attributes:
        centres: (N, D).
        weights: (N,).
        lengths: (D,), Λ = diag(lengths²).
        gain: k (D,).
        max_command: u_max [N·m].
        compensation: of friction.
        bias: of the activation.
    """

    centres: Array
    weights: Array
    lengths: Array
    gain: Array
    max_command: float
    compensation: Compensation
    bias: float


class Activation(NamedTuple):
    """Moments of a(y).

    Attributes:
        mean: E[a].
        slope: E[∇a] (D,), so that Cov(y, a) = S · slope.
        variance: Var[a].
    """

    mean: float
    slope: Array
    variance: float


class ActivationGradients(NamedTuple):
    """Derivatives of a scalar by what `activation_moments` was given.

    Attributes:
        mean: (D,).
        covariance: (D, D), symmetric.
        gain: (D,), by k.
        centres: (N, D).
        weights: (N,).
        lengths: (D,).
    """

    mean: Array
    covariance: Array
    gain: Array
    centres: Array
    weights: Array
    lengths: Array


class _Basis(NamedTuple):
    """What mean, variance and their ways back share.

    Attributes:
        q: E[φ_i] (N,).
        nu: c_i - m (N, D).
        B: (S + Λ)⁻¹ (D, D).
        W: (S + Λ/2)⁻¹ (D, D).
        excess: expm1(Δ_ij) (N, N) for j <= i, half of it for j = i, and zero above, so that the whole is this and its
            transpose.
    """

    q: Array
    nu: Array
    B: Array
    W: Array
    excess: Array


@kernel()
def _basis(centres: Array, lengths: Array, m: Array, S: Array) -> _Basis:
    """Δ_ij = log E[φ_iφ_j] - log E[φ_i] E[φ_j] is a constant, a square of ν_i, one of ν_j and a product of both."""
    n, d = centres.shape
    scaled = S / lengths / lengths.reshape(-1, 1)
    log_single = np.linalg.slogdet(scaled + np.eye(d))[1]
    log_pair = np.linalg.slogdet(2.0 * scaled + np.eye(d))[1]
    precision = np.diag(lengths**-2)
    B = np.linalg.inv(S + np.diag(lengths**2))
    W = np.linalg.inv(S + np.diag(0.5 * lengths**2))
    nu = centres - m
    q = np.exp(-0.5 * (log_single + np.sum((nu @ B) * nu, axis=1)))
    own = np.sum((nu @ (0.5 * B - 0.25 * precision - 0.125 * W)) * nu, axis=1)
    across = nu @ (0.5 * precision - 0.25 * W)  # (N, D)
    columns = np.ascontiguousarray(nu.T)
    shift = log_single - 0.5 * log_pair
    excess = np.zeros((n, n))
    for i in range(n):
        here = excess[i, : i + 1]
        for j in range(i + 1):
            here[j] = shift + own[i] + own[j]
        for k in range(d):
            factor = across[i, k]
            for j in range(i + 1):
                here[j] += factor * columns[k, j]
        expm1_in_place(here)
        here[i] *= 0.5
    return _Basis(q, nu, B, W, excess)  # type: ignore[arg-type]


@kernel()
def activation_moments(network: Network, m: Array, S: Array) -> Activation:
    """Mean, slope and variance of a(y) at y ~ N(m, S)."""
    centres, weights, lengths, gain = network.centres, network.weights, network.lengths, network.gain
    q, nu, B, _, excess = _basis(centres, lengths, m, S)
    smoothed = weights * q
    radial = B @ (nu.T @ smoothed)  # (D,) slope of the radial part
    variance = 2.0 * (smoothed @ (excess @ smoothed))
    variance += gain @ (S @ gain) + 2.0 * (gain @ (S @ radial))
    return Activation(smoothed.sum() + gain @ m + network.bias, radial + gain, max(variance, 0.0))  # type: ignore[arg-type]


@kernel()
def activation_adjoint(  # type: ignore[no-untyped-def]
    network: Network, m: Array, S: Array, by_mean: float, by_slope: Array, by_variance: float
):
    """From the derivatives by mean, slope and variance to those by all that `activation_moments` was given."""
    centres, weights, lengths, gain = network.centres, network.weights, network.lengths, network.gain
    q, nu, B, W, excess = _basis(centres, lengths, m, S)
    n, d = nu.shape
    smoothed = weights * q
    radial = B @ (nu.T @ smoothed)

    # The linear part: mean kᵀm, slope k, variance kᵀSk + 2kᵀS·radial.
    gain_by = by_mean * m + by_slope + 2.0 * by_variance * (S @ (gain + radial))
    mixed = np.outer(gain, radial)
    S_by = by_variance * (np.outer(gain, gain) + mixed + mixed.T)
    h = B @ (by_slope + 2.0 * by_variance * (S @ gain))  # adjoint of Σ w_i q_i ν_i, of which the slope is B times
    BS_by = -0.5 * (np.outer(h, radial) + np.outer(radial, h))  # by S + Λ, through B of the slope

    singly = by_mean + nu @ h
    weights_by = q * (singly + 2.0 * by_variance * (excess @ smoothed + excess.T @ smoothed))
    log_q_by = smoothed * (singly - 2.0 * by_variance * smoothed.sum())
    nu_by = np.outer(smoothed, h)

    # The pairs: C_ij = by_variance w_i w_j P_ij, the derivative by log P_ij, as a lower triangle in place of `excess`.
    for i in range(n):
        for j in range(i):
            excess[i, j] = by_variance * smoothed[i] * smoothed[j] * (excess[i, j] + 1.0)
        excess[i, i] = by_variance * smoothed[i] ** 2 * (excess[i, i] + 0.5)
    ones = np.ones(n)
    rows = excess @ ones + excess.T @ ones  # Σ_j C_ij
    across = excess @ nu + excess.T @ nu  # Σ_j C_ij ν_j (N, D)
    own = nu * rows.reshape(-1, 1)
    squares, products = nu.T @ own, nu.T @ across  # Σ C_ij ν_i ν_iᵀ and Σ C_ij ν_i ν_jᵀ
    total = rows.sum()
    pairs_by = 0.5 * (0.5 * (W @ (squares + products) @ W) - total * W)  # by S + Λ/2
    nu_by -= (own - across) / lengths**2 + 0.5 * ((own + across) @ W)

    # log q_i = -½ log|S + Λ| + ½ log|Λ| - ½ ν_iᵀBν_i.
    Bnu = nu @ B  # (N, D)
    singles = 0.5 * ((Bnu * log_q_by.reshape(-1, 1)).T @ Bnu - log_q_by.sum() * B) + BS_by
    nu_by -= Bnu * log_q_by.reshape(-1, 1)
    S_by += singles + pairs_by
    m_by = by_mean * gain - nu_by.sum(axis=0)
    lengths_by = np.empty(d)
    for k in range(d):
        precision = 1.0 / lengths[k] ** 2
        gap = 2.0 * (squares[k, k] - products[k, k])  # Σ C_ij (ν_ik - ν_jk)²
        by_lambda = singles[k, k] + 0.5 * precision * log_q_by.sum()
        by_lambda += 0.5 * pairs_by[k, k] + 0.5 * precision * total + 0.25 * precision**2 * gap
        lengths_by[k] = 2.0 * lengths[k] * by_lambda
    return ActivationGradients(m_by, S_by, gain_by, nu_by, weights_by, lengths_by)
