"""Derivatives of the smoothed function F(m) = E[h(x)], x ~ N(m, S): all that Hermite moment matching needs.

For one basis function at x_i, with ν = x_i - m and B = (S + Λ)⁻¹, F(m + R t) is q exp(gᵀt - ½ tᵀMt), where
q = α² |SΛ⁻¹ + I|^(-1/2) exp(-½ νᵀBν), g = RᵀBν and M = RᵀBR. Its power series in t is the series of the monomials of g,
summed over the points, times the series of exp(-½ tᵀMt), which is the same for all points.
"""

import numpy as np

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array
from twbal.models.moments.kernel_sum import KernelSum
from twbal.models.moments.multi_index import Integers, MultiIndices

_LANES = 8  # points that the inner loops treat at once: one 512-bit register of doubles


@kernel()
def smoothed_weights(  # type: ignore[no-untyped-def]
    inputs: Array, lengths: Array, signal_variance: float, weights: Array, mean: Array, covariance: Array
):
    """Weights β_i q_i (n,) of the smoothed basis functions, ν (n, d) and B (d, d)."""
    d = len(mean)
    B = np.linalg.inv(covariance + np.diag(lengths**2))  # (d, d)
    determinant = np.linalg.det(covariance / lengths / lengths.reshape(-1, 1) + np.eye(d))
    scale = signal_variance / np.sqrt(determinant)
    offsets = inputs - mean  # (n, d)
    smoothed = np.empty(len(inputs))
    for i in range(len(inputs)):
        distance = 0.0
        for k in range(d):
            row = 0.0
            for j in range(d):
                row += B[k, j] * offsets[i, j]
            distance += row * offsets[i, k]
        smoothed[i] = weights[i] * scale * np.exp(-0.5 * distance)
    return smoothed, offsets, B


@kernel()
def _moment_series(weights: Array, slopes: Array, parents: int, count: int, parent: Integers, axis: Integers) -> Array:
    """Σ_i w_i g_i^γ for the first `count` multi-indices γ, of which the first `parents` have others above them.

    Args:
        slopes: g (d, n).
    """
    d, n = slopes.shape
    sums = np.zeros((count, _LANES))
    monomials = np.empty((max(parents, 1), _LANES))
    block = np.empty((d, _LANES))
    for start in range(0, n, _LANES):
        here = min(_LANES, n - start)
        for lane in range(_LANES):
            inside = lane < here
            monomials[0, lane] = weights[start + lane] if inside else 0.0
            for k in range(d):
                block[k, lane] = slopes[k, start + lane] if inside else 0.0
        for lane in range(_LANES):
            sums[0, lane] += monomials[0, lane]
        for r in range(1, parents):
            p, k = parent[r], axis[r]
            for lane in range(_LANES):
                value = monomials[p, lane] * block[k, lane]
                monomials[r, lane] = value
                sums[r, lane] += value
        for r in range(max(parents, 1), count):
            p, k = parent[r], axis[r]
            for lane in range(_LANES):
                sums[r, lane] += monomials[p, lane] * block[k, lane]
    total = np.zeros(count)
    for r in range(count):
        for lane in range(_LANES):
            total[r] += sums[r, lane]
    return total


@kernel()
def _times_gaussian(series: Array, M: Array, down: Integers) -> None:
    """Multiply a power series by exp(-½ tᵀMt), in place: one factor exp(-c t_k t_l) after the other."""
    d = len(M)
    for k in range(d):
        for l in range(k, d):
            c = 0.5 * M[k, k] if k == l else M[k, l]
            for r in range(len(series) - 1, 0, -1):
                power, factor, step = r, 1.0, 0
                while True:
                    power = down[power, k]
                    if power < 0:
                        break
                    power = down[power, l]
                    if power < 0:
                        break
                    step += 1
                    factor *= -c / step
                    series[r] += factor * series[power]


@kernel()
def add_derivatives(
    total: Array, kernels: KernelSum, mean: Array, covariance: Array, basis: Array, indices: MultiIndices
) -> None:
    """Add ∂^γ F_a(m) along the columns of `basis` to total[a, γ], for all its γ (the first R of `indices`).

    Args:
        total: (E, R), added to in place; R takes in whole degrees.
        basis: R of the module's text, (d, d).
    """
    outputs, count = total.shape
    if len(kernels.inputs) == 0:
        return
    parents = indices.first[np.searchsorted(indices.first, count) - 1]  # all but those of the highest degree
    for a in range(outputs):
        weights, offsets, B = smoothed_weights(
            kernels.inputs, kernels.length_scales[a], kernels.signal_variance[a], kernels.weights[a], mean, covariance
        )
        BR = np.ascontiguousarray(B @ basis)
        slopes = np.ascontiguousarray((offsets @ BR).T)  # (d, n)
        series = _moment_series(weights, slopes, parents, count, indices.parent, indices.axis)
        for r in range(count):
            series[r] /= indices.factorial[r]
        _times_gaussian(series, np.ascontiguousarray(basis.T @ BR), indices.down)
        for r in range(count):
            total[a, r] += series[r] * indices.factorial[r]
