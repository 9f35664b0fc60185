"""How coloured prediction errors are: what a model leaves unexplained shows as their memory."""

from collections.abc import Sequence

import numpy as np

from twbal.gaussian import Array


def whiteness(errors: Sequence[Array], usable: Sequence[Array], lags: int) -> Array:
    r"""Ljung and Box's statistic per channel over its expectation, (4,); 1 for white errors.

    Q = n (n + 2) Σ_k ρ_k² / (n - k), over the first lags k, divided by their number. It grows in proportion to the
    length of the data where errors have memory.

    Args:
        errors: (T + 1, 4) per recording; the first row does not count.
        usable: (T + 1,) per recording.
        lags: [control periods].
    """
    parts = [np.where(u[1:, None], e[1:], 0.0) for e, u in zip(errors, usable, strict=True)]
    count = sum(int(u[1:].sum()) for u in usable)
    power = sum((p**2).sum(axis=0) for p in parts)
    total = np.zeros(4)
    for k in range(1, lags + 1):
        product = sum((p[k:] * p[:-k]).sum(axis=0) for p in parts if len(p) > k)
        total += (product / power) ** 2 / max(count - k, 1)
    return np.asarray(count * (count + 2) * total / lags)
