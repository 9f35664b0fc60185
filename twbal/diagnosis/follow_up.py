"""What a diagnosis says of the recordings: which to make next, and which disagree with the others."""

from collections.abc import Mapping
from math import log
from typing import NamedTuple

DECISIVE = 20.0
"""Odds of the true set over another one that an experiment is expected to bring, from which on it decides."""


def in_nats(ratio: float) -> str:
    """A log likelihood ratio with its unit, to two digits or to whole nats."""
    return f"{ratio:.0f} nats" if abs(ratio) >= 10.0 else f"{ratio:.2g} nats"


class NextExperiment(NamedTuple):
    """The experiment that is expected to separate the remaining sets of effects most.

    Attributes:
        settings: of `real-rollout experiment=excite`, by key.
        seconds: of an episode of it [s].
        separation: expected log likelihood ratio of the true set over another one after an episode, over the
            temperature of the probabilities [nats].
        repetition: the same for as long a repetition of the recordings that there are [nats].
        rivals: the sets, each by the names of its effects, the likeliest first; () is the data sheet refitted.
        refused: candidates that are not offered, as by simulation of one of the sets the robot comes near falling, or
            often meets its torque limit.
        command: to paste into a shell; "" where a diagnosis was none of the command line.
    """

    settings: Mapping[str, float | int]
    seconds: float
    separation: float
    repetition: float
    rivals: tuple[tuple[str, ...], ...]
    refused: int
    command: str = ""

    @property
    def is_decisive(self) -> bool:
        """Whether it is expected to bring odds of `DECISIVE`."""
        return self.separation >= log(DECISIVE)

    @property
    def in_nats(self) -> tuple[str, str]:
        """Separation, and that of a repetition, with their unit."""
        return in_nats(self.separation), in_nats(self.repetition)


class Disagreement(NamedTuple):
    """A recording that disagrees with the others in a value that all share.

    Attributes:
        recording: its name.
        others: names of those that it was held against; without those that disagree more surely.
        parameter: as `effect.parameter`; one of the data sheet is a factor.
        fitted: value that is fitted to all recordings.
        difference: of the recording's own value from that of the others.
        error: standard error of the difference.
        unit: of these; "" for a plain number.
        p_value: probability of at least as large a difference in any value of any recording if there is none.
        alike: other values that explain the disagreement about as well.
    """

    recording: str
    others: tuple[str, ...]
    parameter: str
    fitted: float
    difference: float
    error: float
    unit: str
    p_value: float
    alike: tuple[str, ...] = ()
