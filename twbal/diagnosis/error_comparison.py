"""Errors of simulations beside those of the first, with intervals."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from twbal.core.block_bootstrap import FEWEST_BLOCKS, block_count, interval95, resampled_means
from twbal.core.gaussian import Array
from twbal.core.streams import Stream, generator
from twbal.diagnosis.evaluation_record import Interval

_GAP = 1.1  # times the noise floor, above which the reference's error is a gap of which a share can be closed


class ErrorComparison(NamedTuple):
    """What errors tell of one simulation; see the fields of `PredictionScore`."""

    error: float | None = None
    error95: Interval | None = None
    ratio: float | None = None
    ratio95: Interval | None = None
    noise_floor: float | None = None
    closed: float | None = None
    closed95: Interval | None = None


def compare(
    squares: Sequence[Array], floors: Sequence[Sequence[float]], blocks: Sequence[int], seed: int
) -> list[ErrorComparison]:
    """Each simulation beside the first.

    Args:
        squares: (n, S) squared errors of S simulations on each log; not finite where a prediction diverged.
        floors: of each simulation, noise floors on each log; not finite where there is none.
        blocks: lengths of the blocks of each log.
        seed: of the bootstrap.
    """
    sizes = [len(part) for part in squares]
    count = block_count(sizes, blocks)
    errors = np.sqrt(sum(part.sum(axis=0) for part in squares) / sum(sizes))  # (S,)
    drawn = None
    if count >= FEWEST_BLOCKS:
        drawn = np.sqrt(resampled_means(squares, blocks, generator(Stream.BOOTSTRAP, seed)))
    found = []
    for s, error in enumerate(errors):
        floor = float(np.sqrt(np.average(np.square(floors[s]), weights=sizes)))
        one = ErrorComparison(noise_floor=floor if np.isfinite(floor) else None)
        if np.isfinite(error):
            error95 = None if drawn is None else Interval(*interval95(float(error), drawn[:, s], count))
            one = one._replace(error=float(error), error95=error95)
            if np.isfinite(errors[0]):
                ratios = None if drawn is None else drawn[:, s] / np.maximum(drawn[:, 0], 1e-300)
                one = _beside(one, float(errors[0]), ratios, count)
        found.append(one)
    return found


def _beside(one: ErrorComparison, reference: float, ratios: Array | None, blocks: int) -> ErrorComparison:
    """With what a simulation's error is beside that of the reference, and of its blocks drawn anew (RESAMPLES,)."""
    assert one.error is not None
    ratio = one.error / max(reference, 1e-300)
    ratio95 = None if ratios is None else Interval(*interval95(ratio, ratios, blocks))
    one = one._replace(ratio=ratio, ratio95=ratio95)
    if one.noise_floor is None or reference <= _GAP * one.noise_floor:
        return one
    whole = 1.0 - one.noise_floor / reference
    closed95 = None if ratio95 is None else Interval((1.0 - ratio95.high95) / whole, (1.0 - ratio95.low95) / whole)
    return one._replace(closed=(1.0 - ratio) / whole, closed95=closed95)
