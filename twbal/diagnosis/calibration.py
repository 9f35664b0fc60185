"""Probabilities of effects, corrected by how often such probabilities proved right.

The weights of sets of effects compare these sets with each other. How often an effect of such a weight was really there
is known of recordings of robots with a known truth. By these a probability p is corrected to

    p' = share · 1 / (1 + exp(-(intercept + slope · log(p / (1 - p))))).

The second factor is a logistic regression on the log odds (J. Platt: Probabilistic outputs for support vector machines,
in Advances in Large Margin Classifiers, MIT Press, 2000, 61-74). The first is the share of sure effects that prove
right although something is objected to, by what that is. `python -m benchmarks.calibration` fits all of it, and writes
`calibration.json` beside this module, with the hash of the records that it was fitted to.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from math import exp, log
from pathlib import Path
from typing import NamedTuple

from twbal.core.json_records import read_record

FILE = Path(__file__).with_name("calibration.json")
EDGE = 1e-3
"""Probabilities nearer to 0 and 1 than this count as this near: sets that were not fitted have weight, too."""


class Objected(StrEnum):
    """What is objected to, where an effect is listed."""

    NOTHING = "nothing"
    OTHERS = "others"
    """Other effects, or the chosen set as a whole: residuals that stay autocorrelated, a data sheet that is far off."""
    EFFECT = "effect"
    """The effect itself."""

    @classmethod
    def _missing_(cls, value: object) -> "Objected | None":
        return cls.OTHERS if value == "set" else None  # the whole set, in files of earlier versions


class Bin(NamedTuple):
    """Probabilities of a range, and how many of them proved right.

    Attributes:
        low: end of the range.
        high: end of the range.
        pairs: of a robot and an effect with such a probability.
        said: mean of the probabilities.
        right: share of the effects that were there.
    """

    low: float
    high: float
    pairs: int
    said: float
    right: float


class FittedOn(NamedTuple):
    """What a calibration was fitted to.

    Attributes:
        records: file of the records, within the repository.
        sha256: hash of that file.
        robots: how many.
        pairs: of a robot and an effect.
    """

    records: str
    sha256: str
    robots: int
    pairs: int


@dataclass(frozen=True)
class Calibration:
    """A correction of probabilities.

    Attributes:
        intercept: of the log odds.
        slope: of the log odds.
        shares: of sure effects that prove right, by what is objected to.
        fitted_on: what.
        reliability: of robots that were left out of the fit in turn (cross-validation), by range of the corrected
            probability.
    """

    intercept: float
    slope: float
    shares: Mapping[str, float]
    fitted_on: FittedOn
    reliability: tuple[Bin, ...]

    def corrected(self, probability: float, objected: Objected) -> float:
        """A probability as it was fitted, corrected; 0 stays 0."""
        if probability <= 0.0:
            return 0.0
        within = min(max(probability, EDGE), 1.0 - EDGE)
        odds = self.intercept + self.slope * log(within / (1.0 - within))
        return self.shares[objected] * min(probability / EDGE, 1.0) / (1.0 + exp(-odds))


@cache
def calibration() -> Calibration:
    """The correction that this version has."""
    return read_record(Calibration, FILE)
