"""A normal distribution over the state."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

HALF_WIDTH_95 = 1.96
"""Standard deviations on either side of the mean that hold 95 % of a normal distribution."""


class Gaussian(NamedTuple):
    """N(mean, covariance) over D channels.

    Attributes:
        mean: (D,) in the channels' units.
        covariance: (D, D), symmetric and positive semi-definite.
    """

    mean: Array
    covariance: Array

    @property
    def sd(self) -> Array:
        """Standard deviation of each channel, (D,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def sample(self, count: int, rng: np.random.Generator) -> Array:
        """Draw `count` states, (count, D); also where the covariance is singular."""
        values, vectors = np.linalg.eigh(self.covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))  # (D, D), root @ root.T = covariance
        drawn: Array = self.mean + rng.standard_normal((count, len(self.mean))) @ root.T
        return drawn


def moment_matched_mixture(parts: Sequence[Gaussian]) -> Gaussian:
    """The normal distribution with mean and covariance of the mixture of `parts`, each as likely."""
    means = np.array([part.mean for part in parts])  # (K, D)
    gaps = means - means.mean(axis=0)
    within = np.mean([part.covariance for part in parts], axis=0)
    return Gaussian(means.mean(axis=0), within + gaps.T @ gaps / len(parts))
