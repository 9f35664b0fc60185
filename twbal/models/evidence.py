"""Log evidence of one GP and its gradient in closed form: several times faster than automatic differentiation."""

import numpy as np
import scipy.linalg

from twbal.core.gaussian import Array
from twbal.core.lapack import factor, invert

_BLOCK = 64  # rows of a covariance at a time: they stay in the cache


class Evidence:
    """log p(y | X, θ) over θ = (log ℓ_1, ..., log ℓ_d, log α/σ, log σ).

    The ratio α/σ is a coordinate of its own because it alone decides how well conditioned K = σ² (α²/σ² C + I) is.
    With K⁻¹y = a and M = (aaᵀ - K⁻¹) ∘ α²C the derivatives are ½ Σ_ij M_ij (x_ik - x_jk)²/ℓ_k², Σ_ij M_ij and yᵀa - n
    (Rasmussen and Williams, eq. 5.9).
    """

    def __init__(self, inputs: Array, target: Array) -> None:
        """Keep the data of one output: inputs (n, d), target (n,)."""
        self._inputs = inputs - inputs.mean(axis=0)
        self._target = target
        self._work = np.empty((2, len(target), len(target)))  # kept, as fresh memory takes as long as the exponentials

    def __call__(self, theta: Array) -> tuple[float, Array]:
        """Log evidence [nats] and its gradient (d + 2,) at `theta` (d + 2,); -inf where K cannot be factored."""
        n, y = len(self._target), self._target
        noise = np.exp(2.0 * theta[-1])
        scaled = self._inputs / np.exp(theta[:-2])  # (n, d)
        signal = self._signal_covariance(scaled, noise * np.exp(2.0 * theta[-2]))  # (n, n), column-major
        total = self._work[1].T
        total[:] = signal
        total[np.diag_indices(n)] += noise
        if not factor(total):
            return -np.inf, np.zeros_like(theta)
        alpha = scipy.linalg.cho_solve((total, True), y)
        value = -0.5 * y @ alpha - np.log(np.diag(total)).sum() - 0.5 * n * np.log(2.0 * np.pi)
        invert(total)
        total *= -1.0
        weighted = scipy.linalg.blas.dger(1.0, alpha, alpha, a=total, overwrite_a=1)
        weighted *= signal  # M; only its lower half is meant from here on
        sides = np.column_stack([scaled, np.ones(n)])
        products = scipy.linalg.blas.dsymm(1.0, weighted, np.asfortranarray(sides), lower=1)  # M [Z, 1]
        rows = products[:, -1]
        scales = rows @ scaled**2 - np.einsum("nk,nk->k", scaled, products[:, :-1])
        return float(value), np.concatenate([scales, [rows.sum(), y @ alpha - n]])

    def _signal_covariance(self, scaled: Array, signal_variance: float) -> Array:
        """(n, n), column-major, as LAPACK wants it; only its lower half is meant."""
        squares = 0.5 * np.sum(scaled * scaled, axis=1)
        exponent = np.matmul(scaled, scaled.T, out=self._work[0])
        for begin in range(0, len(scaled), _BLOCK):
            part = exponent[begin : begin + _BLOCK, begin:]
            part -= squares[begin : begin + _BLOCK, None]
            part -= squares[begin:]
            np.minimum(part, 0.0, out=part)
            np.exp(part, out=part)
            part *= signal_variance
        return np.asarray(exponent.T)
