"""A normal distribution over the state."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


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
