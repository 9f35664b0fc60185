"""Moments of f(x) + g(x) at x ~ N(m, S), and the way back from their derivatives to those by m and S.

The mean is F(m), the input-output covariance S Gᵀ with G = E[∇(f + g)], and the covariance is the linear part G S Gᵀ
plus the rest V. V comes from Hermite coefficients where their series is short enough (`hermite`), from the exact sum
over pairs where it is not (`pairwise`), and holds the model variance E[var h(x)] of whatever functions count as
uncertain.
"""

from typing import NamedTuple

import numpy as np

from twbal.compiled import kernel
from twbal.gaussian import Array
from twbal.models.moments.hermite import (
    degree_variances,
    higher_covariance,
    higher_covariance_adjoint,
    term_weights,
)
from twbal.models.moments.kernel_sum import KernelSum
from twbal.models.moments.multi_index import Integers, MultiIndices, multi_indices
from twbal.models.moments.pairwise import pair_moment
from twbal.models.moments.taylor import add_derivatives

DEGREES = (2, 4, 6, 8)
"""Degrees p of the covariance series that are tried in turn; derivatives take two degrees more."""

EXACT = 0
"""As a degree: no series, the sum over pairs."""


class Truncation(NamedTuple):
    """How far to trust a short series.

    Attributes:
        tolerance: share of an output's variance (or of a `reference` above it) that the two degrees past the last may
            still hold.
        degrees: allowed degrees, rising; empty always sums over pairs.
        fall_back: sum over pairs where no degree is enough; otherwise the highest degree serves, and the covariance is
            too small by what it leaves out.
    """

    tolerance: float = 1e-7
    degrees: tuple[int, ...] = DEGREES
    fall_back: bool = True


class Prediction(NamedTuple):
    """Moments of the E outputs at an uncertain input of d channels, with what the way back needs.

    Attributes:
        mean: (E,).
        slope: G (E, d), so that the input-output covariance is S Gᵀ.
        rest: V (E, E), the covariance less G S Gᵀ, model variance included.
        degree: of the series; EXACT where pairs were summed.
        enough: lowest allowed degree that meets the tolerance here; the highest where none does.
        truncated: largest share of an output's variance that the two degrees past the last hold; 0 where exact.
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
def _hessian(row: Array, up: Integers) -> Array:
    """Second derivatives of one output from its row of T, (d, d)."""
    d = up.shape[1]
    hessian = np.empty((d, d))
    for j in range(d):
        for k in range(d):
            hessian[j, k] = row[up[up[0, j], k]]
    return hessian


@kernel()
def _add_model_variance(
    kernels: KernelSum, mean: Array, covariance: Array, rest: Array, by_mean: Array, by_covariance: Array
) -> None:
    """Add E[var h_a(x)] = α² - Σ_ij W_ij E[k_i k_j] (eq. 3, averaged over x) and its derivatives, in place."""
    for a in range(len(rest)):
        _, reduction, dm, ds = pair_moment(a, kernels, a, kernels, kernels.variance_matrix[a], mean, covariance)
        rest[a, a] += max(kernels.signal_variance[a] - reduction, 0.0)
        by_mean[a, a] -= dm
        by_covariance[a, a] -= ds


@kernel()
def _add_pair_covariance(
    f: KernelSum, g: KernelSum, mean: Array, covariance: Array, rest: Array, by_mean: Array, by_covariance: Array
) -> None:
    """Add Cov[(f + g)_a, (f + g)_b], and the derivatives of E[(f + g)_a (f + g)_b], in place."""
    nothing = np.zeros((0, 0))
    for a in range(len(rest)):
        for b in range(a + 1):
            for first in (f, g):
                for second in (f, g):
                    if len(first.inputs) == 0 or len(second.inputs) == 0:
                        continue
                    value, _, dm, ds = pair_moment(a, first, b, second, nothing, mean, covariance)
                    rest[a, b] += value
                    by_mean[a, b] += dm
                    by_covariance[a, b] += ds
            rest[b, a], by_mean[b, a], by_covariance[b, a] = rest[a, b], by_mean[a, b], by_covariance[a, b]


def _derivatives(f: KernelSum, g: KernelSum, mean: Array, covariance: Array, basis: Array, degree: int) -> Array:
    """T of f + g up to `degree`, (E, R): the coefficients of a sum are the sums of the coefficients."""
    indices = multi_indices(len(mean), degree)
    T = np.zeros((len(f.weights), len(indices.parent)))
    add_derivatives(T, f, mean, covariance, basis, indices)
    add_derivatives(T, g, mean, covariance, basis, indices)
    return T


def predict(
    f: KernelSum,
    g: KernelSum,
    mean: Array,
    covariance: Array,
    truncation: Truncation,
    start_degree: int = 2,
    reference: Array | float = 0.0,
) -> Prediction:
    """Moments of f(x) + g(x) for x ~ N(mean, covariance) (eq. 7-8 with an uncertain input).

    Args:
        f, g: functions of the same d inputs; each counts as uncertain where it brings a variance matrix.
        mean: (d,).
        covariance: (d, d), positive semi-definite; may be singular.
        truncation: which series to trust.
        start_degree: first degree tried, for callers who know their last one.
        reference: (E,) variances beside which an error in that of an output does not count, as where the output is
            added to something that varies more.
    """
    d, outputs = len(mean), len(f.weights)
    typical = np.exp(np.log(f.length_scales).mean(axis=0))  # (d,)
    eigenvalues, vectors = np.linalg.eigh(covariance / np.outer(typical, typical))
    eigenvalues = np.maximum(eigenvalues, 0.0)
    basis = np.ascontiguousarray(typical[:, None] * vectors)
    inverse_basis = np.ascontiguousarray(vectors.T / typical)
    rest = np.zeros((outputs, outputs))
    by_mean, by_covariance = np.zeros((outputs, outputs, d)), np.zeros((outputs, outputs, d, d))

    degree, enough, truncated, T = EXACT, max(truncation.degrees, default=EXACT), 0.0, np.zeros((outputs, 0))
    for candidate in (p for p in truncation.degrees if p >= start_degree):
        indices = multi_indices(d, candidate + 2)
        T = _derivatives(f, g, mean, covariance, basis, candidate + 2)
        weights = term_weights(eigenvalues, indices)
        shares = _left_out(degree_variances(T, weights, indices.first), reference)
        met = [p for p in truncation.degrees if p <= candidate and shares[p] <= truncation.tolerance]
        if met or (candidate == truncation.degrees[-1] and not truncation.fall_back):
            degree, enough, truncated = candidate, min(met, default=enough), shares[candidate]
            rest += higher_covariance(T, weights, indices.first[2], indices.first[degree + 1])
            break
    if degree == EXACT:
        truncated = 0.0
        if T.shape[1] == 0:
            T = _derivatives(f, g, mean, covariance, basis, 3)
        _add_pair_covariance(f, g, mean, covariance, rest, by_mean, by_covariance)
    slope = T[:, 1 : d + 1] @ inverse_basis
    if degree == EXACT:
        rest -= slope @ covariance @ slope.T
        # The pairs gave the derivative of E[h_a h_b]; take off that of E[h_a] E[h_b].
        hessians = _hessians(T, inverse_basis)
        m = T[:, 0]
        by_mean -= m[:, None, None] * slope[None] + m[None, :, None] * slope[:, None]
        by_covariance -= 0.5 * (m[:, None, None, None] * hessians[None] + m[None, :, None, None] * hessians[:, None])
    for kernels in (f, g):
        if kernels.has_variance:
            _add_model_variance(kernels, mean, covariance, rest, by_mean, by_covariance)
    return Prediction(
        T[:, 0], slope, rest, degree, enough, truncated, T, eigenvalues, basis, inverse_basis, by_mean, by_covariance
    )


def _left_out(variances: Array, reference: Array | float) -> Array:
    """For each degree p, the largest share of a variance that the degrees p + 1 and p + 2 hold, (p_max - 1,)."""
    past = variances[:, 1:-1] + variances[:, 2:]
    whole = np.maximum(np.maximum(variances[:, 1:].sum(axis=1), reference), 1e-300)
    shares: Array = np.max(past / whole[:, None], axis=0)
    return shares


def _hessians(T: Array, inverse_basis: Array) -> Array:
    """E[∇∇h_a] in raw coordinates, (E, d, d)."""
    up = multi_indices(len(inverse_basis), 3).up
    return np.array([inverse_basis.T @ _hessian(row, up) @ inverse_basis for row in T])


@kernel()
def _first_moments_adjoint(T: Array, by_value: Array, by_slope: Array, up: Integers):  # type: ignore[no-untyped-def]
    """Way back from the mean and the slope, all along the columns of R."""
    outputs, d = by_slope.shape
    by_mean, by_input = np.zeros(d), np.zeros((d, d))
    for a in range(outputs):
        for k in range(d):
            by_mean[k] += by_value[a] * T[a, 1 + k]
            for l in range(d):
                second = T[a, up[up[0, k], l]]
                by_mean[k] += by_slope[a, l] * second
                by_input[k, l] += 0.5 * by_value[a] * second
                for j in range(d):
                    by_input[k, l] += 0.5 * by_slope[a, j] * T[a, up[up[up[0, j], k], l]]
    return by_mean, by_input


def predict_adjoint(
    prediction: Prediction, covariance: Array, by_value: Array, by_slope: Array, by_rest: Array
) -> tuple[Array, Array]:
    """From the derivatives by mean, slope and rest to those by the input's mean (d,) and covariance (d, d) (eq. 15-16).

    Args:
        covariance: S that the prediction was made at, (d, d).
        by_value: (E,).
        by_slope: (E, d).
        by_rest: (E, E), symmetric.
    """
    p, inverse = prediction, prediction.inverse_basis
    d = len(inverse)
    direct: Array = np.zeros((d, d))
    if p.degree == EXACT:
        by_slope = by_slope - 2.0 * by_rest @ p.slope @ covariance
        direct = -p.slope.T @ by_rest @ p.slope
    third = multi_indices(d, 3).up
    slope_along = np.ascontiguousarray(by_slope @ inverse.T)
    by_mean, by_input = _first_moments_adjoint(p.derivatives, by_value, slope_along, third)
    if p.degree != EXACT:
        indices: MultiIndices = multi_indices(d, p.degree + 2)
        weights = term_weights(p.eigenvalues, indices)
        dm, ds = higher_covariance_adjoint(p.derivatives, weights, np.ascontiguousarray(by_rest), indices, p.degree)
        by_mean, by_input = by_mean + dm, by_input + ds
    by_mean = inverse.T @ by_mean + np.einsum("ab,abk->k", by_rest, p.exact_by_mean)
    by_covariance = inverse.T @ by_input @ inverse + direct
    by_covariance = by_covariance + np.einsum("ab,abkl->kl", by_rest, p.exact_by_covariance)
    return by_mean, by_covariance
