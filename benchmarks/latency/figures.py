"""What is said of many latencies."""

from collections.abc import Sequence
from math import ceil
from typing import Any

import numpy as np

EDGES_MS = (0.0, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
"""Of the histogram [ms]; what is longer is counted last."""

PERCENTILES = (50.0, 90.0, 99.0, 99.9)
_ROUNDING = 1e-6  # by which a number of commands may be off


def distribution(latencies: Sequence[float], period: float) -> dict[str, Any]:
    """Shares, percentiles and a histogram.

    Args:
        latencies: of commands [s]; at least one.
        period: beyond which a command is late [s].

    Returns:
        Shares in per cent, times in ms, `histogram` the counts from each of `EDGES_MS` to the next.
    """
    times = np.asarray(latencies) * 1e3
    counts, _ = np.histogram(times, [*EDGES_MS, np.inf])
    return {
        "commands": len(times),
        "within_2_ms": 100.0 * float(np.mean(times <= 2.0)),
        "within_5_ms": 100.0 * float(np.mean(times <= 5.0)),
        "percentiles_ms": {f"{rank:g}": _percentile(times, rank) for rank in PERCENTILES},
        "longest_ms": round(float(times.max()), 3),
        "late": int(np.sum(times > 1e3 * period)),
        "histogram": [int(count) for count in counts],
    }


def _percentile(times: np.ndarray, rank: float) -> float:
    """The smallest that at least this share is not beyond, which is one that was measured."""
    number = ceil(1e-2 * rank * len(times) - _ROUNDING)
    return round(float(np.sort(times)[max(number, 1) - 1]), 3)
