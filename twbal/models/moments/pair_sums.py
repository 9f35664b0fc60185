"""Exact covariances and model variances of f + g, by sums over pairs of points (`pairwise`)."""

import numpy as np

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array
from twbal.models.moments.kernel_sum import KernelSum
from twbal.models.moments.multi_index import Integers
from twbal.models.moments.pairwise import own_moment, pair_moment


@kernel()
def add_model_variance(
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
def add_pairs(
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
def take_off_first_moments(T: Array, inverse: Array, up: Integers, by_mean: Array, by_covariance: Array) -> None:
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
