"""Multi-indices of total degree <= p in d variables, in graded order, with the tables that walk between them."""

from functools import cache
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]


class MultiIndices(NamedTuple):
    """All α with |α| <= p, lowest degree first; R = (p + d choose d) of them.

    Attributes:
        parent: (R,) index of α - e_k for one k = `axis`; -1 for α = 0.
        axis: (R,) that k.
        up: (R, d) index of α + e_k, -1 where its degree would exceed p.
        down: (R, d) index of α - e_k, -1 where α_k = 0.
        powers: (R, d) the α themselves.
        factorial: (R,) α! = Π α_k!.
        first: (p + 2,) where each degree begins; first[p + 1] = R.
    """

    parent: Integers
    axis: Integers
    up: Integers
    down: Integers
    powers: Integers
    factorial: NDArray[np.float64]
    first: Integers


@cache
def multi_indices(dimension: int, degree: int) -> MultiIndices:
    """The tables for `dimension` variables and total degree <= `degree`."""
    chosen = [c for k in range(degree + 1) for c in combinations_with_replacement(range(dimension), k)]
    place = {c: i for i, c in enumerate(chosen)}
    count = len(chosen)
    parent, axis = np.full(count, -1), np.zeros(count, dtype=np.int64)
    up, down = np.full((count, dimension), -1), np.full((count, dimension), -1)
    powers = np.zeros((count, dimension), dtype=np.int64)
    for c, i in place.items():
        for k in c:
            powers[i, k] += 1
        if c:
            parent[i], axis[i] = place[c[:-1]], c[-1]
        if len(c) < degree:
            for k in range(dimension):
                j = place[tuple(sorted((*c, k)))]
                up[i, k], down[j, k] = j, i
    degrees = powers.sum(axis=1)
    first = np.searchsorted(degrees, np.arange(degree + 2))
    factorials = np.cumprod([1.0, *range(1, degree + 1)])
    return MultiIndices(parent, axis, up, down, powers, factorials[powers].prod(axis=1), first)
