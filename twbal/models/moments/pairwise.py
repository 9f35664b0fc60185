"""Exact second moments as sums over pairs of points: the model variance, and where Hermite series are too long.

For basis functions at x_i (Λ_a) and x_j (Λ_b), E[k_i k_j] is proportional to exp(-½ δᵀWδ) in the mean m, with
W = (S + Λ)⁻¹, Λ = (Λ_a⁻¹ + Λ_b⁻¹)⁻¹ and δ = Λ (Λ_a⁻¹ν_i + Λ_b⁻¹ν_j); so its derivative by m is Wδ times itself and, by
the heat equation, that by S is ½ (Wδδᵀ W - W) times itself.
"""

import numpy as np

from twbal.core.compiled import fused, kernel
from twbal.core.exponential import expm1_in_place
from twbal.core.gaussian import Array
from twbal.models.moments.kernel_sum import KernelSum
from twbal.models.moments.taylor import smoothed_weights

_ROWS = 32  # that are summed at once: as many as stay in the processor's cache


@kernel(is_kept=False)
def _add_products(exponents: Array, factors: Array, betas: Array) -> None:
    """Add factors · betas[:, j], (d,) and (d, n), to each of some of the exponents: those of the first columns."""
    d, n, k = len(factors), len(exponents), 0
    while k + 2 < d:
        a, b, c = factors[k], factors[k + 1], factors[k + 2]
        for j in range(n):
            exponents[j] = fused(betas[k, j], a, fused(betas[k + 1, j], b, fused(betas[k + 2, j], c, exponents[j])))
        k += 3
    while k < d:
        a = factors[k]
        for j in range(n):
            exponents[j] = fused(betas[k, j], a, exponents[j])
        k += 1


@kernel()
def _pair_sums(  # type: ignore[no-untyped-def]
    weights_a: Array,
    half_a: Array,
    alpha: Array,
    weights_b: Array,
    half_b: Array,
    beta: Array,
    shift: float,
):
    """Sums over pairs of c_ij = w_i w_j: Σ c (e^Δ - 1), Σ c e^Δ, and row, column and cross sums of c e^Δ.

    Δ_ij = shift + half_a[i] + half_b[j] + alpha[i]·beta[j].
    """
    d = alpha.shape[1]
    n_a, n_b = len(weights_a), len(weights_b)
    centred, columns, cross = 0.0, np.zeros(n_b), np.empty((n_a, d + 1))
    betas = np.ascontiguousarray(beta.T)  # (d, n_b)
    sides = np.hstack((beta, np.ones((n_b, 1))))
    block = np.empty((_ROWS, n_b))
    for start in range(0, n_a, _ROWS):
        end = min(start + _ROWS, n_a)
        for i in range(start, end):
            here, base, weight = block[i - start], shift + half_a[i], weights_a[i]
            for j in range(n_b):
                here[j] = base + half_b[j]
            _add_products(here, alpha[i], betas)
            expm1_in_place(here)
            centred += weight * np.dot(weights_b, here)
            for j in range(n_b):
                both = weight * weights_b[j]
                here[j] = fused(both, here[j], both)
                columns[j] += here[j]
        cross[start:end] = block[: end - start] @ sides
    rows = np.ascontiguousarray(cross[:, d])
    return centred, rows.sum(), rows, columns, np.ascontiguousarray(cross[:, :d])


@kernel()
def _symmetric_sums(  # type: ignore[no-untyped-def]
    q: Array, half: Array, alpha: Array, beta: Array, weights: Array, links: Array, shift: float
):
    """`_pair_sums` of one set of points with itself, where Δ is symmetric: half of the pairs are enough.

    Of c_ij = q_i q_j (w_i w_j - links_ij); `weights` may be empty, which stands for zeros, and so may `links`.

    Returns:
        Σ q_i q_j w_i w_j (e^Δ - 1); Σ q_i q_j links_ij e^Δ; the row sums of c e^Δ (n,); and L beta (n, d) with L the
        lower triangle of c e^Δ, its diagonal halved, so that the sum over all pairs is L and its transpose.
    """
    n, d = alpha.shape
    linked, weighted = len(links) > 0, len(weights) > 0
    columns, cross = np.zeros(n), np.empty((n, d + 1))
    betas = np.ascontiguousarray(beta.T)  # (d, n)
    sides = np.hstack((beta, np.ones((n, 1))))
    qw = q * weights if weighted else np.zeros(n)
    bonds, ones = np.empty(n), np.ones(n)
    centred, linked_sum = 0.0, 0.0
    for start in range(0, n, _ROWS):
        end = min(start + _ROWS, n)
        lower = np.zeros((end - start, end))
        for i in range(start, end):
            here = lower[i - start, : i + 1]
            base = shift + half[i]
            for j in range(i + 1):
                here[j] = base + half[j]
            _add_products(here, alpha[i], betas)
            expm1_in_place(here)
            if weighted:
                centred += qw[i] * (2.0 * np.dot(here, qw[: i + 1]) - here[i] * qw[i])
            if linked:
                for j in range(i + 1):
                    bonds[j] = (here[j] + 1.0) * (q[i] * q[j] * links[i, j])
                    here[j] = (here[j] + 1.0) * (qw[i] * qw[j]) - bonds[j]
                linked_sum += 2.0 * np.dot(bonds[:i], ones[:i]) + bonds[i]
            else:
                for j in range(i + 1):
                    here[j] = (here[j] + 1.0) * (qw[i] * qw[j])
            here[i] *= 0.5
            for j in range(i + 1):
                columns[j] += here[j]
        cross[start:end] = lower @ sides[:end]
    rows = cross[:, d] + columns
    return centred, linked_sum, rows, np.ascontiguousarray(cross[:, :d])


@kernel()
def own_moment(a: int, kernels: KernelSum, weights: Array, links: Array, mean: Array, covariance: Array):  # type: ignore[no-untyped-def]
    """`pair_moment` of output a of `kernels` with itself, at half of its cost; δ_ij = (ν_i + ν_j) / 2 here.

    With β as weights and W of eq. 3 as links it gives h_a's variance and the model's in one.

    Args:
        weights: w (n,), or (0,) for zeros.
        links: (n, n), or (0, 0) for zeros.

    Returns:
        E[h²] - E[h]² of h = Σ w_i k_i; Σ links_ij E[k_i k_j]; the derivatives of E[h²] less that sum, by m and by S.
    """
    d = len(mean)
    lengths = kernels.length_scales[a]
    ones = np.ones(len(kernels.inputs))
    q, nu, B = smoothed_weights(kernels.inputs, lengths, kernels.signal_variance[a], ones, mean, covariance)
    precision = 2.0 * lengths**-2  # (d,)
    W = np.linalg.inv(covariance + np.diag(1.0 / precision))
    p = 0.5 * nu  # (n, d)
    K = np.diag(precision) - W
    pK = p @ K
    half = 0.5 * np.sum(pK * p + (nu @ B) * nu - (nu / lengths) ** 2, axis=1)
    eye = np.eye(d)
    log_one = np.linalg.slogdet(covariance / lengths / lengths.reshape(-1, 1) + eye)[1]
    log_two = np.linalg.slogdet(2.0 * covariance / lengths / lengths.reshape(-1, 1) + eye)[1]
    shift = log_one - 0.5 * log_two
    centred, linked_sum, rows, cross = _symmetric_sums(q, half, pK, p, weights, links, shift)
    mixed = p.T @ cross
    mixed = mixed + mixed.T + p.T @ (p * rows.reshape(-1, 1))
    by_mean = W @ (2.0 * (rows @ p))
    by_covariance = 0.5 * (W @ (2.0 * mixed) @ W - rows.sum() * W)
    return centred, linked_sum, by_mean, by_covariance


@kernel()
def pair_moment(  # type: ignore[no-untyped-def]
    a: int, first: KernelSum, b: int, second: KernelSum, mean: Array, covariance: Array
):
    """Second moment of output a of `first` and output b of `second`.

    Returns:
        E[h_a h_b] - E[h_a] E[h_b] (the covariance, free of cancellation), E[h_a h_b], and the derivatives of the latter
        by m (d,) and by S (d, d).
    """
    d = len(mean)
    beta_a, beta_b = first.weights[a], second.weights[b]
    lengths_a, lengths_b = first.length_scales[a], second.length_scales[b]
    w_a, nu_a, B_a = smoothed_weights(first.inputs, lengths_a, first.signal_variance[a], beta_a, mean, covariance)
    w_b, nu_b, B_b = smoothed_weights(second.inputs, lengths_b, second.signal_variance[b], beta_b, mean, covariance)
    precision = lengths_a**-2 + lengths_b**-2  # (d,)
    W = np.linalg.inv(covariance + np.diag(1.0 / precision))
    p = nu_a / lengths_a**2 / precision  # (n_a, d), δ_ij = p_i + r_j
    r = nu_b / lengths_b**2 / precision
    # log of E[k_i k_j] / (E[k_i] E[k_j]): -½(…) = quadratic in ν_i, in ν_j, and p_iᵀ (precision - W) r_j.
    K = np.diag(precision) - W
    half_a = 0.5 * np.sum((p @ K) * p + (nu_a @ B_a) * nu_a - (nu_a / lengths_a) ** 2, axis=1)
    half_b = 0.5 * np.sum((r @ K) * r + (nu_b @ B_b) * nu_b - (nu_b / lengths_b) ** 2, axis=1)
    eye = np.eye(d)
    log_a = np.linalg.slogdet(covariance / lengths_a / lengths_a.reshape(-1, 1) + eye)[1]
    log_b = np.linalg.slogdet(covariance / lengths_b / lengths_b.reshape(-1, 1) + eye)[1]
    root = np.sqrt(precision)
    log_ab = np.linalg.slogdet(covariance * root * root.reshape(-1, 1) + eye)[1]
    shift = 0.5 * (log_a + log_b - log_ab)
    centred, total, rows, columns, cross = _pair_sums(w_a, half_a, p @ K, w_b, half_b, r, shift)
    # cross holds Σ_j c_ij r_j for each i.
    first_moment = rows @ p + columns @ r
    mixed = p.T @ cross
    second_moment = p.T @ (p * rows.reshape(-1, 1)) + r.T @ (r * columns.reshape(-1, 1)) + mixed + mixed.T
    by_mean = W @ first_moment
    by_covariance = 0.5 * (W @ second_moment @ W - total * W)
    return centred, total, by_mean, by_covariance
