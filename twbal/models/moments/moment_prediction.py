"""Moments of f(x) + g(x) at x ~ N(m, S), and the way back from their derivatives to those by m and S.

The mean is F(m), the input-output covariance S Gᵀ with G = E[∇(f + g)], and the covariance is the linear part G S Gᵀ
plus the rest V. V comes from Hermite coefficients where their series is short enough (`hermite`), from the exact sum
over pairs where it is not (`pairwise`), and holds the model variance E[var h(x)] of whatever functions count as
uncertain.
"""

from typing import NamedTuple

import numpy as np

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array
from twbal.models.moments.hermite import degree_variances, higher_covariance, term_weights
from twbal.models.moments.kernel_sum import KernelSum
from twbal.models.moments.multi_index import MultiIndices
from twbal.models.moments.pair_sums import add_model_variance, add_pairs, take_off_first_moments
from twbal.models.moments.taylor import add_derivatives
from twbal.models.moments.truncation import EXACT, LOWEST, Series, left_out

_REST = 4  # predictions by pairs without a trial, after a trial that failed


class MomentPrediction(NamedTuple):
    """Moments of the E outputs at an uncertain input of d channels, with what the way back needs.

    Attributes:
        mean: (E,).
        slope: G (E, d), so that the input-output covariance is S Gᵀ.
        rest: V (E, E), the covariance less G S Gᵀ, model variance included.
        degree: of the series; EXACT where pairs were summed.
        enough: lowest degree worth a trial at a distribution much like this one: the lowest allowed that meets the
            tolerance. Where pairs were summed, more than the highest: that many times are pairs summed without a trial.
        truncated: estimate of what the series leaves out, as `Truncation.tolerance` bounds it; 0 where exact.
        derivatives: T (E, R) along the columns of `basis`.
        eigenvalues: λ (d,) of S in that basis.
        basis: R (d, d).
        inverse_basis: R⁻¹ (d, d).
        exact_by_mean: (E, E, d), derivative by m of what was summed over pairs (covariance and model variance).
        exact_by_covariance: (E, E, d, d), the same by S.
    """

    mean: Array
    slope: Array
    rest: Array
    degree: int
    enough: int
    truncated: float
    derivatives: Array
    eigenvalues: Array
    basis: Array
    inverse_basis: Array
    exact_by_mean: Array
    exact_by_covariance: Array


@kernel()
def _derivatives(
    f: KernelSum, g: KernelSum, mean: Array, covariance: Array, basis: Array, indices: MultiIndices, degree: int
) -> Array:
    """T of f + g up to `degree`, (E, R): the coefficients of a sum are the sums of the coefficients."""
    T = np.zeros((len(f.weights), indices.first[degree + 1]))
    add_derivatives(T, f, mean, covariance, basis, indices)
    add_derivatives(T, g, mean, covariance, basis, indices)
    return T


@kernel()
def _axes(typical: Array, covariance: Array):  # type: ignore[no-untyped-def]
    """Eigenvalues (d,) of S in the inputs' units `typical`, the basis R with S = R diag(λ) Rᵀ, and R⁻¹."""
    d = len(typical)
    scaled = np.empty((d, d))
    for j in range(d):
        for k in range(d):
            scaled[j, k] = covariance[j, k] / (typical[j] * typical[k])
    eigenvalues, vectors = np.linalg.eigh(scaled)
    basis, inverse = np.empty((d, d)), np.empty((d, d))
    for j in range(d):
        for k in range(d):
            basis[j, k] = typical[j] * vectors[j, k]
            inverse[k, j] = vectors[j, k] / typical[j]
    return np.maximum(eigenvalues, 0.0), basis, inverse


@kernel()
def predict_by_series(
    f: KernelSum, g: KernelSum, mean: Array, covariance: Array, cut: Series, start_degree: int, reference: Array
) -> MomentPrediction:
    """Moments of f(x) + g(x) for x ~ N(mean, covariance) (eq. 7-8 with an uncertain input).

    Args:
        f, g: functions of the same d inputs; each counts as uncertain where it brings a variance matrix.
        mean: (d,).
        covariance: (d, d), positive semi-definite; may be singular.
        cut: which series to trust.
        start_degree: first degree tried, for callers who know what was enough for the last distribution.
        reference: (E,) variances beside which an error in that of an output does not count, as where the output is
            added to something that varies more.
    """
    d, outputs = len(mean), len(f.weights)
    typical = np.empty(d)
    for k in range(d):
        typical[k] = np.exp(np.log(f.length_scales[:, k]).mean())
    eigenvalues, basis, inverse_basis = _axes(typical, covariance)
    first = cut.indices.first
    rest = np.zeros((outputs, outputs))
    by_mean, by_covariance = np.zeros((outputs, outputs, d)), np.zeros((outputs, outputs, d, d))

    degree, enough, truncated, T = EXACT, EXACT, 0.0, np.zeros((outputs, 0))
    if len(cut.degrees):
        enough = cut.degrees[-1]
        if cut.fall_back:
            enough = start_degree - 1 if start_degree > enough else enough + _REST
    for candidate in cut.degrees:
        if candidate < start_degree:
            continue
        T = _derivatives(f, g, mean, covariance, basis, cut.indices, candidate + 2)
        weights = term_weights(eigenvalues, cut.indices, T.shape[1])
        variances = degree_variances(T, weights, first, candidate + 2)
        met = EXACT
        for p in cut.degrees:
            if p <= candidate and left_out(variances, reference, p) <= cut.tolerance:
                met = p
                break
        if met != EXACT or (candidate == cut.degrees[-1] and not cut.fall_back):
            degree, truncated = candidate, left_out(variances, reference, candidate)
            enough = candidate if met == EXACT else met
            rest += higher_covariance(T, weights, first[2], first[degree + 1])
            break
    if degree == EXACT and T.shape[1] == 0:
        lowest = int(np.int64(LOWEST))  # a bare constant is a type of its own to numba, and compiled anew
        T = _derivatives(f, g, mean, covariance, basis, cut.indices, lowest)
    slope = np.ascontiguousarray(T[:, 1 : d + 1]) @ inverse_basis
    if degree == EXACT:
        add_pairs(f, g, mean, covariance, rest, by_mean, by_covariance)
        rest -= slope @ covariance @ slope.T
        take_off_first_moments(T, inverse_basis, cut.indices.up, by_mean, by_covariance)
    else:
        for kernels in (f, g):
            if kernels.variance_matrix.shape[1] > 0:
                add_model_variance(kernels, mean, covariance, rest, by_mean, by_covariance)
    value = T[:, 0].copy()
    return MomentPrediction(
        value, slope, rest, degree, enough, truncated, T, eigenvalues, basis, inverse_basis, by_mean, by_covariance
    )
