"""Rows that two recordings have in common."""

from collections.abc import Iterator, Sequence
from itertools import combinations

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
    for j, i in combinations(range(len(episodes)), 2):
        both = [
            k
            for k, name in enumerate(Observation._fields)
            if name != "time" and name not in estimated[i] | estimated[j]
        ]
        (mine, count), (other, least) = (_runs(episodes[k].observations[:, both]) for k in (i, j))
        runs = len(mine & other)
        shared = min(runs + _RUN - 1, count)  # of one piece
        if runs > 0.5 * min(len(mine), len(other)) and min(count, least) >= _RUN:
            yield f"{names[i]} has {shared} of its {count} rows in common with {names[j]}: take one of them"


def _runs(rows: Array) -> tuple[set[bytes], int]:
    """Every `_RUN` rows in a row, and how many rows there are."""
    return {rows[k : k + _RUN].tobytes() for k in range(len(rows) - _RUN + 1)}, len(rows)
