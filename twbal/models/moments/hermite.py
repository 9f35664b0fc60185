"""Covariance of GP means at x ~ N(m, S) as a Gram matrix of Hermite coefficients.

With S = R diag(λ) Rᵀ and T_aγ = ∂^γ F_a(m) along the columns of R, the normalised Hermite coefficient of
h_a(m + R √λ z) is √(λ^α / α!) T_aα, so Cov_ab = Σ_{|α|>=1} (λ^α / α!) T_aα T_bα: positive semi-definite by
construction. The terms of degree 1 are the linear part, E[∇h_a]ᵀ S E[∇h_b]; the functions here give the rest,
|α| = 2..p, and its exact derivatives, which need T up to degree p + 2.
"""

import numpy as np

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array
from twbal.models.moments.multi_index import Integers, MultiIndices


@kernel()
def term_weights(eigenvalues: Array, indices: MultiIndices, count: int) -> Array:
    """λ^α / α! for each of the first `count` α."""
    weights = np.ones(count)
    for r in range(1, len(weights)):
        k = indices.axis[r]
        weights[r] = weights[indices.parent[r]] * eigenvalues[k] / indices.powers[r, k]
    return weights


@kernel()
def degree_variances(T: Array, weights: Array, first: Integers, degree: int) -> Array:
    """What each degree up to `degree` adds to the variance of each output, (E, degree + 1)."""
    outputs = len(T)
    variances = np.zeros((outputs, degree + 1))
    for a in range(outputs):
        for p in range(degree + 1):
            for r in range(first[p], first[p + 1]):
                variances[a, p] += weights[r] * T[a, r] ** 2
    return variances


@kernel()
def higher_covariance(T: Array, weights: Array, first: int, last: int) -> Array:
    """Σ λ^α / α! T_aα T_bα over the indices first <= α < last, (E, E)."""
    outputs = len(T)
    covariance = np.zeros((outputs, outputs))
    for a in range(outputs):
        for b in range(a + 1):
            total = 0.0
            for r in range(first, last):
                total += weights[r] * T[a, r] * T[b, r]
            covariance[a, b] = covariance[b, a] = total
    return covariance


@kernel()
def higher_covariance_adjoint(  # type: ignore[no-untyped-def]
    T: Array, weights: Array, by_covariance: Array, indices: MultiIndices, degree: int
):
    """Derivative of Σ_ab by_covariance[a, b] higher_covariance[a, b] by m and S, both along the columns of R.

    By m, each coefficient's derivative is the coefficient one degree up. By S there are two parts: S in the smoothing
    (heat equation: half the second derivative by m) and S in the weights λ^α, which lowers the degree by one.

    Args:
        by_covariance: (E, E), symmetric.
        degree: p, the highest degree that the covariance sums.
    """
    outputs, d = len(T), indices.up.shape[1]
    by_mean, by_input = np.zeros(d), np.zeros((d, d))
    first, last = indices.first[1], indices.first[degree + 1]
    H = by_covariance @ np.ascontiguousarray(T[:, :last])  # (E, R_p)
    here = np.empty(d)
    for b in range(outputs):
        for r in range(first, last):
            scaled = weights[r] * H[b, r]
            inside = r < indices.first[degree]
            quadratic = r >= indices.first[2]
            for j in range(d):
                up = indices.up[r, j]
                here[j] = T[b, up]
                if quadratic:
                    by_mean[j] += 2.0 * scaled * here[j]
                    for l in range(j + 1):
                        by_input[j, l] += scaled * T[b, indices.up[up, l]]
            if inside:
                for j in range(d):
                    for l in range(j + 1):
                        by_input[j, l] += weights[r] * here[j] * H[b, indices.up[r, l]]
    for j in range(d):
        for l in range(j):
            by_input[l, j] = by_input[j, l]
    return by_mean, by_input
