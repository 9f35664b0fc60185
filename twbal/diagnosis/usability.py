"""Whether the rollouts of a run of Algorithm 1 are enough for a diagnosis."""

from collections.abc import Sequence
from typing import NamedTuple

from twbal.core.episode import Episode


class Amount(NamedTuple):
    """How much data a diagnosis needs, as in `Usability`.

    Attributes:
        shortest: control periods of an episode, below which it is left out.
        fewest: control periods of all episodes together.
    """

    shortest: int
    fewest: int


FEW_DATA = Amount(shortest=15, fewest=150)
"""For such rollouts, which wander and fall: they tell more than as much of a robot that stands."""


def enough_for_diagnosis(episodes: Sequence[Episode]) -> bool:
    """Whether the episodes are long enough, one by one and together, for a diagnosis with `FEW_DATA`."""
    lengths = [len(episode) for episode in episodes]
    return sum(length for length in lengths if length >= FEW_DATA.shortest) >= FEW_DATA.fewest
