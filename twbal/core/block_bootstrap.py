"""Intervals for means of correlated samples: blocks of them are drawn anew (circular block bootstrap).

Politis and Romano, A circular block-resampling procedure for stationary data, 1992. Blocks must be long against the
samples' correlation, so there are few of them, and the standard deviation that they tell is uncertain itself: as in
Hesterberg (What teachers should know about the bootstrap, 2015, section 5) it is widened by √(m / (m - 1)), and
Student's t of m - 1 degrees of freedom takes the place of the normal distribution, m being the number of blocks.
"""

from collections.abc import Sequence

import numpy as np
from scipy.special import stdtrit

from twbal.core.gaussian import Array

RESAMPLES = 2000
FEWEST_BLOCKS = 4
"""Below so many blocks there is no interval."""


def block_count(sizes: Sequence[int], lengths: Sequence[int]) -> int:
    """How many blocks are drawn of parts with so many samples each."""
    return sum(size // length for size, length in zip(sizes, lengths, strict=True))


def resampled_means(parts: Sequence[Array], lengths: Sequence[int], rng: np.random.Generator) -> Array:
    """Means over all parts, of blocks drawn anew within each, (RESAMPLES, K).

    The same instants are drawn for all K columns, so that ratios of them keep what they have in common.

    Args:
        parts: (n_i, K), samples in order.
        lengths: of the blocks of each part, at most n_i.
        rng: draws them.
    """
    total = np.zeros((RESAMPLES, parts[0].shape[1]))
    for part, length in zip(parts, lengths, strict=True):
        size, blocks = len(part), max(len(part) // length, 1)
        round_again = np.vstack([np.zeros_like(part[:1]), part, part[: length - 1]])
        sums = np.cumsum(round_again, axis=0)
        means = (sums[length:] - sums[:-length]) / length  # (n_i, K), of the block that begins at each sample
        for first in rng.integers(size, size=(blocks, RESAMPLES)):
            total += size / blocks * means[first]
    return total / sum(map(len, parts))


def interval95(value: float, resampled: Array, blocks: int) -> tuple[float, float]:
    """Interval of a positive figure, symmetric in its logarithm.

    Args:
        value: the figure.
        resampled: (RESAMPLES,) its values by blocks drawn anew.
        blocks: how many are drawn, at least `FEWEST_BLOCKS`.
    """
    sd = float(np.std(np.log(np.maximum(resampled, 1e-300)))) * np.sqrt(blocks / (blocks - 1.0))
    factor = float(np.exp(min(stdtrit(blocks - 1, 0.975) * sd, 100.0)))
    return value / factor, value * factor
