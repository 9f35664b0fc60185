"""Whether the rollouts of a run of Algorithm 1 are enough for a diagnosis."""

from collections.abc import Sequence
from typing import Any, NamedTuple

from twbal.core.episode import Episode


class Amount(NamedTuple):
    """How much data a diagnosis needs, as in `Usability`.

    Attributes:
        min_length: control periods of an episode that count, below which it is left out.
        min_samples: control periods of all episodes together that count.
    """

    min_length: int
    min_samples: int


ONE_RUN_TOLERANCES: dict[str, Any] = {"battery": 0.0, "floor_slope": 0.0}
"""Tolerances for such rollouts: of one robot, whose battery and floor hardly change in the minutes that they take."""

FEW_DATA = Amount(min_length=15, min_samples=150)
"""For such rollouts, which wander and fall: they tell more than as much of a robot that stands."""


def enough_for_diagnosis(episodes: Sequence[Episode], needed: Amount = FEW_DATA) -> bool:
    """Whether the episodes are long enough, one by one and together, for a diagnosis that needs so much."""
    lengths = [len(episode) for episode in episodes]
    return sum(length for length in lengths if length >= needed.min_length) >= needed.min_samples
