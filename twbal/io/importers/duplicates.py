"""Rows that two recordings have in common."""

from collections.abc import Iterator, Sequence
from functools import cache
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from twbal.core.episode import Episode
from twbal.core.gaussian import Array
from twbal.core.plant import Observation

_RUN = 4  # rows in a row that are compared as one


def duplicated(episodes: Sequence[Episode], names: Sequence[str]) -> Iterator[str]:
    """Recordings of which another one has most of the rows already.

    What counts is what both measured, over some rows in a row: a channel that was worked out is another one where a
    recording was cut, and coarse sensors at rest say the same in many recordings.
    """
    estimated = [{each.channel for each in episode.estimated} for episode in episodes]

    @cache  # mostly all recordings measured the same
    def runs_of(number: int, channels: tuple[int, ...]) -> NDArray[np.int64]:
        return _runs(episodes[number].observations[:, channels])

    for j, i in combinations(range(len(episodes)), 2):
        both = tuple(
            k
            for k, name in enumerate(Observation._fields)
            if name != "time" and name not in estimated[i] | estimated[j]
        )
        mine, other = runs_of(i, both), runs_of(j, both)
        count, least = len(episodes[i].observations), len(episodes[j].observations)
        runs = len(np.intersect1d(mine, other, assume_unique=True))
        shared = min(runs + _RUN - 1, count)  # of one piece
        if runs > 0.5 * min(len(mine), len(other)) and min(count, least) >= _RUN:
            yield f"{names[i]} has {shared} of its {count} rows in common with {names[j]}: take one of them"


def _runs(rows: Array) -> NDArray[np.int64]:
    """Hashes of every `_RUN` rows in a row, each once, in order."""
    data, width = rows.tobytes(), rows.shape[1] * rows.itemsize
    runs = range(0, len(data) - _RUN * width + 1, width)
    return np.unique(np.fromiter((hash(data[k : k + _RUN * width]) for k in runs), np.int64))
