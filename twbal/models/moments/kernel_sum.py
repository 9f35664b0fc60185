"""What moment matching needs of a GP: a weighted sum of squared-exponential basis functions."""

from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array


class KernelSum(NamedTuple):
    """E functions h_a(x) = Σ_i β_ai α_a² exp(-½ (x - x_i)ᵀ Λ_a⁻¹ (x - x_i)) (eq. 1-2).

    Attributes:
        inputs: x_i (n, d); n = 0 is the zero function.
        length_scales: (E, d), Λ_a = diag(length_scales[a]²).
        signal_variance: (E,), α² of eq. 1.
        weights: (E, n), β_a = K_a⁻¹ y_a.
        variance_matrix: (E, n, n), W_a with var h_a(x) = α² - k(x)ᵀ W_a k(x) (eq. 3: W = K⁻¹); (E, 0, 0) where the
            functions count as known.
    """

    inputs: Array
    length_scales: Array
    signal_variance: Array
    weights: Array
    variance_matrix: Array


def no_kernels(outputs: int, dimension: int) -> KernelSum:
    """The zero function with `outputs` outputs of `dimension` inputs."""
    return KernelSum(
        np.zeros((0, dimension)),
        np.ones((outputs, dimension)),
        np.zeros(outputs),
        np.zeros((outputs, 0)),
        np.zeros((outputs, 0, 0)),
    )
