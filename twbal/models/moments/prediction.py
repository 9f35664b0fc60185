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
from twbal.models.moments.hermite import (
    degree_variances,
    higher_covariance,
    higher_covariance_adjoint,
    term_weights,
)
from twbal.models.moments.kernel_sum import KernelSum
from twbal.models.moments.multi_index import Integers, MultiIndices, multi_indices
from twbal.models.moments.pairwise import own_moment, pair_moment
from twbal.models.moments.taylor import add_derivatives

DEGREES = (2, 4, 6, 8, 10)
"""Degrees p of the covariance series that are tried in turn; derivatives take two degrees more."""

_LOWEST = 3  # degree of the derivatives that mean, slope and their ways back need

_SLOWEST_FALL = 0.9  # a series that falls slower than that is not trusted anyway

_REST = 4  # predictions by pairs without a trial, after a trial that failed

EXACT = 0
"""As a degree: no series, the sum over pairs."""


class Truncation(NamedTuple):
    """How far to trust a short series.

    Attributes:
        tolerance: largest error, as a share of an output's variance (or of a `reference` above it), of covariances and
            their derivatives; estimated from the two degrees past the last.
        degrees: allowed degrees, rising; empty always sums over pairs.
        fall_back: sum over pairs where no degree is enough; otherwise the highest degree serves, and the covariance is
            too small by what it leaves out.
    """

    tolerance: float = 1e-6
    degrees: tuple[int, ...] = DEGREES
    fall_back: bool = True


class Series(NamedTuple):
    """A truncation for d inputs, as compiled code takes it.

    Attributes:
        tolerance, degrees, fall_back: see `Truncation`; degrees (k,).
        indices: multi-indices up to two degrees past the last.
    """

    tolerance: float
    degrees: Integers
    fall_back: bool
    indices: MultiIndices


def series(truncation: Truncation, dimension: int) -> Series:
    """The tables of a truncation, for `dimension` inputs."""
    highest = max((p + 2 for p in truncation.degrees), default=_LOWEST)
    degrees = np.array(truncation.degrees, dtype=np.int64)
    return Series(float(truncation.tolerance), degrees, truncation.fall_back, multi_indices(dimension, highest))


class Prediction(NamedTuple):
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
def _add_model_variance(
    kernels: KernelSum, mean: Array, covariance: Array, rest: Array, by_mean: Array, by_covariance: Array
) -> None:
    """Add E[var h_a(x)] = α² - Σ_ij W_ij E[k_i k_j] (eq. 3, averaged over x) and its derivatives, in place."""
    for a in range(len(rest)):
        links = kernels.variance_matrix[a]
        _, reduction, dm, ds = own_moment(a, kernels, np.zeros(0), links, mean, covariance)
        rest[a, a] += max(kernels.signal_variance[a] - reduction, 0.0)
        by_mean[a, a] += dm
        by_covariance[a, a] += ds


@kernel()
def _add_pairs(
    f: KernelSum, g: KernelSum, mean: Array, covariance: Array, rest: Array, by_mean: Array, by_covariance: Array
) -> None:
    """Add Cov[(f + g)_a, (f + g)_b] and the model variance; of both and of E[h_a] E[h_b] add the derivatives."""
    for a in range(len(rest)):
        for kernels in (f, g):
            if len(kernels.inputs) > 0:
                links = kernels.variance_matrix[a]
                value, reduction, dm, ds = own_moment(a, kernels, kernels.weights[a], links, mean, covariance)
                rest[a, a] += value
                if len(links) > 0:
                    rest[a, a] += max(kernels.signal_variance[a] - reduction, 0.0)
                by_mean[a, a] += dm
                by_covariance[a, a] += ds
        if len(f.inputs) > 0 and len(g.inputs) > 0:
            value, _, dm, ds = pair_moment(a, f, a, g, mean, covariance)
            rest[a, a] += 2.0 * value
            by_mean[a, a] += 2.0 * dm
            by_covariance[a, a] += 2.0 * ds
        for b in range(a):
            for first in (f, g):
                for second in (f, g):
                    if len(first.inputs) == 0 or len(second.inputs) == 0:
                        continue
                    value, _, dm, ds = pair_moment(a, first, b, second, mean, covariance)
                    rest[a, b] += value
                    by_mean[a, b] += dm
                    by_covariance[a, b] += ds
            rest[b, a], by_mean[b, a], by_covariance[b, a] = rest[a, b], by_mean[a, b], by_covariance[a, b]


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
def _left_out(variances: Array, reference: Array, p: int) -> float:
    """Bound, by all we have seen, on what a series up to degree p leaves out of a variance and of its derivatives.

    As a share of the variance, derivatives in units of S's own size. A degree q of size v_q takes part in them with
    some 2q v_q. The two degrees past p are known (two, as one may vanish by symmetry); later ones go on falling as
    these two fell from the two before.
    """
    share = 0.0
    for a in range(len(variances)):
        v = variances[a]
        whole = max(v[1:].sum(), reference[a], 1e-300)
        fall = (v[p + 1] + v[p + 2]) / max(v[p - 1] + v[p], 1e-300)
        known = 2.0 * ((p + 1) * v[p + 1] + (p + 2) * v[p + 2])
        share = max(share, known / (1.0 - min(fall, _SLOWEST_FALL)) / whole)
    return share


@kernel()
def _take_off_first_moments(T: Array, inverse: Array, up: Integers, by_mean: Array, by_covariance: Array) -> None:
    """From the derivatives of E[h_a h_b] by m and S take off those of E[h_a] E[h_b], in place."""
    outputs, d = len(T), len(inverse)
    slope = np.ascontiguousarray(T[:, 1 : d + 1]) @ inverse
    hessians = np.empty((outputs, d, d))
    for a in range(outputs):
        along = np.empty((d, d))
        for j in range(d):
            for k in range(d):
                along[j, k] = T[a, up[up[0, j], k]]
        hessians[a] = inverse.T @ along @ inverse
    for a in range(outputs):
        for b in range(outputs):
            by_mean[a, b] -= T[a, 0] * slope[b] + T[b, 0] * slope[a]
            by_covariance[a, b] -= 0.5 * (T[a, 0] * hessians[b] + T[b, 0] * hessians[a])


@kernel()
def predict_by_series(
    f: KernelSum, g: KernelSum, mean: Array, covariance: Array, told: Series, start_degree: int, reference: Array
) -> Prediction:
    """`predict` with the truncation's tables at hand; reference (E,)."""
    d, outputs = len(mean), len(f.weights)
    typical = np.empty(d)
    for k in range(d):
        typical[k] = np.exp(np.log(f.length_scales[:, k]).mean())
    eigenvalues, basis, inverse_basis = _axes(typical, covariance)
    first = told.indices.first
    rest = np.zeros((outputs, outputs))
    by_mean, by_covariance = np.zeros((outputs, outputs, d)), np.zeros((outputs, outputs, d, d))

    degree, enough, truncated, T = EXACT, EXACT, 0.0, np.zeros((outputs, 0))
    if len(told.degrees):
        enough = told.degrees[-1]
        if told.fall_back:
            enough = start_degree - 1 if start_degree > enough else enough + _REST
    for candidate in told.degrees:
        if candidate < start_degree:
            continue
        T = _derivatives(f, g, mean, covariance, basis, told.indices, candidate + 2)
        weights = term_weights(eigenvalues, told.indices, T.shape[1])
        variances = degree_variances(T, weights, first, candidate + 2)
        met = EXACT
        for p in told.degrees:
            if p <= candidate and _left_out(variances, reference, p) <= told.tolerance:
                met = p
                break
        if met != EXACT or (candidate == told.degrees[-1] and not told.fall_back):
            degree, truncated = candidate, _left_out(variances, reference, candidate)
            enough = candidate if met == EXACT else met
            rest += higher_covariance(T, weights, first[2], first[degree + 1])
            break
    if degree == EXACT and T.shape[1] == 0:
        lowest = int(np.int64(_LOWEST))  # a bare constant is a type of its own to numba, and compiled anew
        T = _derivatives(f, g, mean, covariance, basis, told.indices, lowest)
    slope = np.ascontiguousarray(T[:, 1 : d + 1]) @ inverse_basis
    if degree == EXACT:
        _add_pairs(f, g, mean, covariance, rest, by_mean, by_covariance)
        rest -= slope @ covariance @ slope.T
        _take_off_first_moments(T, inverse_basis, told.indices.up, by_mean, by_covariance)
    else:
        for kernels in (f, g):
            if kernels.variance_matrix.shape[1] > 0:
                _add_model_variance(kernels, mean, covariance, rest, by_mean, by_covariance)
    value = T[:, 0].copy()
    return Prediction(
        value, slope, rest, degree, enough, truncated, T, eigenvalues, basis, inverse_basis, by_mean, by_covariance
    )


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
        start_degree: first degree tried, for callers who know what was enough for the last distribution.
        reference: (E,) variances beside which an error in that of an output does not count, as where the output is
            added to something that varies more.
    """
    beside = np.zeros(len(f.weights)) + reference
    mean, covariance = np.ascontiguousarray(mean), np.ascontiguousarray(covariance)
    return predict_by_series(f, g, mean, covariance, series(truncation, len(mean)), start_degree, beside)


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


@kernel()
def predict_adjoint(  # type: ignore[no-untyped-def]
    prediction: Prediction, covariance: Array, indices: MultiIndices, by_value: Array, by_slope: Array, by_rest: Array
):
    """From the derivatives by mean, slope and rest to those by the input's mean (d,) and covariance (d, d) (eq. 15-16).

    Args:
        covariance: S that the prediction was made at, (d, d).
        indices: of its series.
        by_value: (E,).
        by_slope: (E, d).
        by_rest: (E, E), symmetric.
    """
    inverse = prediction.inverse_basis
    outputs, d = by_slope.shape
    direct = np.zeros((d, d))
    if prediction.degree == EXACT:
        by_slope = by_slope - 2.0 * (by_rest @ prediction.slope @ covariance)
        direct -= prediction.slope.T @ by_rest @ prediction.slope
    by_mean, by_input = _first_moments_adjoint(prediction.derivatives, by_value, by_slope @ inverse.T, indices.up)
    if prediction.degree != EXACT:
        weights = term_weights(prediction.eigenvalues, indices, prediction.derivatives.shape[1])
        dm, ds = higher_covariance_adjoint(prediction.derivatives, weights, by_rest, indices, prediction.degree)
        by_mean, by_input = by_mean + dm, by_input + ds
    by_mean = inverse.T @ by_mean
    by_covariance = inverse.T @ by_input @ inverse + direct
    for a in range(outputs):
        for b in range(outputs):
            by_mean += by_rest[a, b] * prediction.exact_by_mean[a, b]
            by_covariance += by_rest[a, b] * prediction.exact_by_covariance[a, b]
    return by_mean, by_covariance
