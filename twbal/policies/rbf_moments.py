"""Moments of a(y) = kᵀy + Σ_i w_i exp(-½ (y - c_i)ᵀΛ⁻¹(y - c_i)) at y ~ N(m, S), and the way back from them.

Exact, as sums over basis functions and their pairs. With ν_i = c_i - m and B = (S + Λ)⁻¹,
E[φ_i] = q_i = |SΛ⁻¹ + I|^(-1/2) exp(-½ ν_iᵀBν_i); with δ = (ν_i + ν_j) / 2 and W = (S + Λ/2)⁻¹,
E[φ_iφ_j] = |2SΛ⁻¹ + I|^(-1/2) exp(-¼ (c_i - c_j)ᵀΛ⁻¹(c_i - c_j) - ½ δᵀWδ). The variance is summed as q_iq_j
expm1(Δ_ij), which loses no digits where S is small.
"""

from typing import NamedTuple

import numpy as np

from twbal.compiled import kernel
from twbal.gaussian import Array


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


@kernel()
def _basis(centres: Array, lengths: Array, m: Array, S: Array):  # type: ignore[no-untyped-def]
    """q (N,), ν (N, D), B and W (D, D), and log|SΛ⁻¹ + I| - ½ log|2SΛ⁻¹ + I|."""
    d = len(m)
    scaled = S / lengths / lengths.reshape(-1, 1)
    log_single = np.linalg.slogdet(scaled + np.eye(d))[1]
    log_pair = np.linalg.slogdet(2.0 * scaled + np.eye(d))[1]
    B = np.linalg.inv(S + np.diag(lengths**2))
    W = np.linalg.inv(S + np.diag(0.5 * lengths**2))
    nu = centres - m
    q = np.empty(len(centres))
    for i in range(len(centres)):
        q[i] = np.exp(-0.5 * (log_single + nu[i] @ B @ nu[i]))
    return q, nu, B, W, log_single - 0.5 * log_pair


@kernel()
def _pair_exponent(i: int, j: int, shift: float, half: Array, nu: Array, W: Array, lengths: Array) -> float:
    """Δ_ij = log E[φ_iφ_j] - log E[φ_i] E[φ_j]; half[i] = ½ ν_iᵀBν_i."""
    distance, spread = 0.0, 0.0
    d = len(lengths)
    for k in range(d):
        gap = (nu[i, k] - nu[j, k]) / lengths[k]
        distance += gap * gap
        row = 0.0
        for l in range(d):
            row += W[k, l] * (nu[i, l] + nu[j, l])
        spread += row * (nu[i, k] + nu[j, k])
    exponent: float = shift + half[i] + half[j] - 0.25 * distance - 0.125 * spread
    return exponent


@kernel()
def activation_moments(centres: Array, weights: Array, lengths: Array, gain: Array, m: Array, S: Array) -> Activation:
    """Mean, slope and variance of a(y) at y ~ N(m, S).

    Args:
        centres: (N, D); weights: (N,); lengths: (D,), Λ = diag(lengths²); gain: k (D,).
    """
    q, nu, B, W, shift = _basis(centres, lengths, m, S)
    n = len(q)
    smoothed = weights * q
    radial = B @ (nu.T @ smoothed)  # (D,) slope of the radial part
    half = np.empty(n)
    for i in range(n):
        half[i] = 0.5 * (nu[i] @ B @ nu[i])
    variance = 0.0
    for i in range(n):
        for j in range(i + 1):
            exponent = _pair_exponent(i, j, shift, half, nu, W, lengths)
            term = smoothed[i] * smoothed[j] * np.expm1(exponent)
            variance += term if i == j else 2.0 * term
    variance += gain @ S @ gain + 2.0 * (gain @ S @ radial)
    return Activation(smoothed.sum() + gain @ m, radial + gain, max(variance, 0.0))


@kernel()
def _add_pairs(  # type: ignore[no-untyped-def]
    q: Array,
    weights: Array,
    nu: Array,
    W: Array,
    lengths: Array,
    shift: float,
    half: Array,
    by_variance: float,
    log_q_by: Array,
    weights_by: Array,
    nu_by: Array,
):
    """Way back from V = Σ w_iw_j (P_ij - q_iq_j), P_ij = E[φ_iφ_j]: adds to the last three, in place.

    Returns:
        Derivatives by S through W, (D, D); Σ c and Σ c (c_i - c_j)² (D,), with c the derivative by log P_ij.
    """
    n, d = nu.shape
    smoothed = weights * q
    pulls = np.zeros((d, d))  # Σ of c Wδ(Wδ)ᵀ
    gaps = np.zeros(d)
    total = 0.0
    delta, pull = np.empty(d), np.empty(d)
    for i in range(n):
        for j in range(i + 1):
            fold = by_variance if i == j else 2.0 * by_variance
            small = np.expm1(_pair_exponent(i, j, shift, half, nu, W, lengths))
            product = smoothed[i] * smoothed[j]
            weights_by[i] += fold * q[i] * smoothed[j] * small
            weights_by[j] += fold * q[j] * smoothed[i] * small
            log_q_by[i] -= fold * product
            log_q_by[j] -= fold * product
            c = fold * product * (small + 1.0)
            total += c
            for k in range(d):
                delta[k] = 0.5 * (nu[i, k] + nu[j, k])
            for k in range(d):
                value = 0.0
                for l in range(d):
                    value += W[k, l] * delta[l]
                pull[k] = value
            for k in range(d):
                gap = nu[i, k] - nu[j, k]
                gaps[k] += c * gap * gap
                stretch = 0.5 * gap / lengths[k] ** 2
                nu_by[i, k] -= c * (stretch + 0.5 * pull[k])
                nu_by[j, k] -= c * (0.5 * pull[k] - stretch)
                for l in range(d):
                    pulls[k, l] += c * pull[k] * pull[l]
    return 0.5 * (pulls - total * W), total, gaps


@kernel()
def activation_adjoint(  # type: ignore[no-untyped-def]
    centres: Array,
    weights: Array,
    lengths: Array,
    gain: Array,
    m: Array,
    S: Array,
    by_mean: float,
    by_slope: Array,
    by_variance: float,
):
    """From the derivatives by mean, slope and variance to those by all that `activation_moments` was given."""
    q, nu, B, W, shift = _basis(centres, lengths, m, S)
    n, d = nu.shape
    smoothed = weights * q
    moment = nu.T @ smoothed  # s = Σ w_i q_i ν_i, radial slope = B s
    radial = B @ moment
    half = np.empty(n)
    for i in range(n):
        half[i] = 0.5 * (nu[i] @ B @ nu[i])

    # The linear part: mean kᵀm, slope k, variance kᵀSk + 2kᵀS·radial.
    gain_by = by_mean * m + by_slope + 2.0 * by_variance * (S @ (gain + radial))
    m_by = by_mean * gain
    mixed = np.outer(gain, radial)
    S_by = by_variance * (np.outer(gain, gain) + mixed + mixed.T)
    h = B @ (by_slope + 2.0 * by_variance * (S @ gain))  # adjoint of s
    BS_by = -0.5 * (np.outer(h, radial) + np.outer(radial, h))  # by S + Λ, through B of the slope

    log_q_by = smoothed * (by_mean + nu @ h)  # by log q_i, to which the pairs add
    weights_by = q * (by_mean + nu @ h)
    nu_by = np.outer(smoothed, h)
    pairs_by, total, gaps = _add_pairs(
        q, weights, nu, W, lengths, shift, half, by_variance, log_q_by, weights_by, nu_by
    )

    # log q_i = -½ log|S + Λ| + ½ log|Λ| - ½ ν_iᵀBν_i.
    Bnu = nu @ B  # (N, D)
    singles = 0.5 * ((Bnu * log_q_by.reshape(-1, 1)).T @ Bnu - log_q_by.sum() * B) + BS_by
    nu_by -= Bnu * log_q_by.reshape(-1, 1)
    S_by += singles + pairs_by
    m_by = m_by - nu_by.sum(axis=0)
    lambda_by = np.empty(d)  # by Λ_kk
    for k in range(d):
        precision = 1.0 / lengths[k] ** 2
        lambda_by[k] = singles[k, k] + 0.5 * precision * log_q_by.sum()
        lambda_by[k] += 0.5 * pairs_by[k, k] + 0.5 * precision * total + 0.25 * precision**2 * gaps[k]
    return ActivationGradients(m_by, S_by, gain_by, nu_by, weights_by, 2.0 * lengths * lambda_by)
