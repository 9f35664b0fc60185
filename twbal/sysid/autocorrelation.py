"""Autocorrelation of prediction errors: what a model leaves unexplained shows as their memory."""

from collections.abc import Sequence

import numpy as np

from twbal.core.gaussian import Array


def ljung_box_ratio(errors: Sequence[Array], variances: Array, count: int, lags: int) -> Array:
    r"""Ljung and Box's statistic per channel over its expectation, (4,); 1 for white errors.

    Q = n (n + 2) Σ_k ρ_k² / (n - k), over the first lags k, divided by their number. It grows in proportion to the
    length of the data where errors have memory. Errors that are smaller than their noise is taken to be count the less:
    ρ_k is their autocovariance over the larger of the two variances. A channel without errors, as it was not measured,
    counts as white.

    Args:
        errors: (T, 4) per recording, by robust weights, 0 where they do not count.
        variances: (4,) that the errors are taken to have.
        count: n, instants that count in all.
        lags: [control periods].
    """
    power = sum((part**2).sum(axis=0) for part in errors)
    largest = np.maximum(power, count * variances)
    total = np.zeros(4)
    for k in range(1, lags + 1):
        product = sum((part[k:] * part[:-k]).sum(axis=0) for part in errors if len(part) > k)
        total += (product / np.maximum(largest, 1e-300)) ** 2 / max(count - k, 1)
    return np.where(power > 0.0, count * (count + 2) * total / lags, 1.0)
