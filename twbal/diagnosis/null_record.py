"""How often chance alone makes the best effect score more than it did: the record that reports and files keep."""

from typing import NamedTuple


class NullScore(NamedTuple):
    """The best further effect beside the set that was chosen, and what chance makes of it.

    Attributes:
        name: of the effect.
        score: its gain in -2 log likelihood less the BIC penalty, over the residual autocorrelation.
        p_value: probability that the best of all further effects scores at least that where none of them is there.
        median: of the best score where none is there.
        high: its 99th percentile.
    """

    name: str
    score: float
    p_value: float
    median: float
    high: float

    @property
    def text(self) -> str:
        """The same in two sentences."""
        chance = f"{self.p_value:.1%}" if self.p_value >= 0.001 else "less than 0.1%"
        return (
            f"The best further effect, {self.name.replace('_', ' ')}, has a score of {self.score:.3g}. If none is "
            f"there, chance makes the best one score at least that with a probability of {chance}."
        )
