"""Encoders of two wheels of which one counts backward, as where motors are mounted in mirror image."""

import numpy as np

from twbal.core.gaussian import Array

_SPANS = 10, 30, 100  # rows over which ways are compared
_BLOCKS = 8  # spans that a log must have at least
_AGAINST = -0.8  # correlation of both ways, from which on one runs against the other


def run_against_each_other(left: Array, right: Array) -> bool:
    """Whether one wheel counts backward while the other counts forward, over short and over long spans.

    A robot that turns on the spot has wheels that run against each other over long spans alone: it balances by both.

    Args:
        left: (n,) what its encoder says, without jumps, in any unit.
        right: (n,) the same of the other wheel.
    """
    there = np.isfinite(left) & np.isfinite(right)
    ways = np.column_stack([left[there], right[there]])
    found = []
    for span in _SPANS:
        if len(ways) < _BLOCKS * span:
            break
        steps = ways[span:] - ways[:-span]
        if not np.ptp(steps, axis=0).all():
            return False
        found.append(float(np.corrcoef(steps[:, 0], steps[:, 1])[0, 1]))
    return bool(found) and max(found) < _AGAINST
