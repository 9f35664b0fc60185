"""Functions drawn from a GP posterior, cheap to follow along a rollout.

Pathwise conditioning (Wilson et al. 2020, "Efficiently sampling functions from Gaussian process posteriors"): a
function from the prior, as M random Fourier features, is corrected by what the data say against it:
h(x) = φ(x)ᵀw + k(x, C) (β - W Φw + R ε), with β, W and R of the posterior (`Posterior`) and ε ~ N(0, I).
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from twbal.core.compiled import fused, kernel
from twbal.core.cosine import cosine_of_turns
from twbal.core.gaussian import Array
from twbal.models.gp import GaussianProcess

_WIDTH = 32  # columns of a product are padded to multiples of it


@dataclass(frozen=True, eq=False)
class FunctionSamples:
    """n functions with E outputs each, drawn from a GP posterior.

    Attributes:
        gp: the posterior.
        frequencies: (E, M, d) of the features.
        phases: (E, M).
        features: (E, M, n) weights w of the prior part.
        corrections: (E, centres, n) weights of the data's part.
    """

    gp: GaussianProcess
    frequencies: Array
    phases: Array
    features: Array
    corrections: Array

    @classmethod
    def draw(cls, gp: GaussianProcess, count: int, features: int, rng: np.random.Generator) -> Self:
        """Draw `count` functions with `features` random features an output."""
        E, d = gp.outputs, gp.inputs
        frequencies = rng.standard_normal((E, features, d)) / gp.length_scales[:, None, :]
        phases = rng.uniform(0.0, 2.0 * np.pi, (E, features))
        amplitude = np.sqrt(2.0 * gp.signal_variance / features)
        weights = amplitude[:, None, None] * rng.standard_normal((E, features, count))
        deviations = rng.standard_normal((E, len(gp.centres), count))
        corrections = np.empty_like(deviations)
        for a in range(E):
            angles = _product(gp.centres, np.ascontiguousarray(frequencies[a].T)) + phases[a]
            prior = _product(_cosines(angles / (2.0 * np.pi)), weights[a])  # (centres, n)
            corrections[a] = gp.weights[a][:, None] + _strayed(gp, a, prior, deviations[a])
        return cls(gp, frequencies, phases, weights, corrections)

    def __call__(self, inputs: Array) -> Array:
        """Function i at input i, (n, E), for inputs (n, d)."""
        values = np.empty((len(inputs), self.gp.outputs))
        for a in range(self.gp.outputs):
            waves = np.cos(inputs @ self.frequencies[a].T + self.phases[a])  # (n, M)
            values[:, a] = np.einsum("nm,mn->n", waves, self.features[a])
            values[:, a] += np.einsum("nc,cn->n", self.gp.covariance(inputs, a), self.corrections[a])
        return values


def _strayed(gp: GaussianProcess, output: int, prior: Array, deviations: Array) -> Array:
    """R ε - W Φw, (centres, n); where R = σ W, that is one product."""
    if gp.sample_root is not None:
        return _product(gp.root(output), deviations) - _product(gp.variance_matrix[output], prior)
    spread = np.sqrt(gp.noise_variance[output])
    return _product(gp.variance_matrix[output], spread * deviations - prior)


@kernel()
def _cosines(turns: Array) -> Array:
    """cos 2πz of all numbers (n, m)."""
    found = np.empty(turns.shape)
    for i in range(len(turns)):
        for j in range(turns.shape[1]):
            found[i, j] = cosine_of_turns(turns[i, j])
    return found


def _product(left: Array, right: Array) -> Array:
    """The matrix product of (n, m) and (m, p), with the same digits however many threads there are.

    Libraries share a product among threads in blocks, and their digits depend on the blocks.
    """
    columns = right.shape[1]
    product = _padded_product(left, np.pad(right, ((0, 0), (0, -columns % _WIDTH))))
    return np.ascontiguousarray(product[:, :columns])


@kernel()
def _padded_product(left: Array, right: Array) -> Array:
    """The product, of whole vectors; four terms at a time, as long as there are four."""
    product, fours = np.zeros((len(left), right.shape[1])), len(right) // 4 * 4
    for i in range(len(left)):
        for k in range(0, fours, 4):
            a, b, c, d = left[i, k], left[i, k + 1], left[i, k + 2], left[i, k + 3]
            for j in range(right.shape[1]):
                pair = fused(b, right[k + 1, j], fused(a, right[k, j], product[i, j]))
                product[i, j] = fused(d, right[k + 3, j], fused(c, right[k + 2, j], pair))
        for k in range(fours, len(right)):
            for j in range(right.shape[1]):
                product[i, j] = fused(left[i, k], right[k, j], product[i, j])
    return product
