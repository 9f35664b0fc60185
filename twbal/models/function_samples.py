"""Functions drawn from a GP posterior, cheap to follow along a rollout.

Pathwise conditioning (Wilson et al. 2020, "Efficiently sampling functions from Gaussian process posteriors"): a
function from the prior, as M random Fourier features, is corrected by what the data say against it:
h(x) = φ(x)ᵀw + k(x, C) (β - W Φw + R ε), with β, W and R of the posterior (`Posterior`) and ε ~ N(0, I).
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from twbal.core.gaussian import Array
from twbal.models.gp import GaussianProcess


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
            prior = np.cos(gp.centres @ frequencies[a].T + phases[a]) @ weights[a]  # (centres, n)
            corrections[a] = gp.weights[a][:, None] - gp.variance_matrix[a] @ prior + gp.root(a) @ deviations[a]
        return cls(gp, frequencies, phases, weights, corrections)

    def __call__(self, inputs: Array) -> Array:
        """Function i at input i, (n, E), for inputs (n, d)."""
        values = np.empty((len(inputs), self.gp.outputs))
        for a in range(self.gp.outputs):
            waves = np.cos(inputs @ self.frequencies[a].T + self.phases[a])  # (n, M)
            values[:, a] = np.einsum("nm,mn->n", waves, self.features[a])
            values[:, a] += np.einsum("nc,cn->n", self.gp.covariance(inputs, a), self.corrections[a])
        return values
