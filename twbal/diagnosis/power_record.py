"""What recordings would have shown: the record that reports list and that `diagnosis.json` keeps."""

from typing import NamedTuple


class SizePower(NamedTuple):
    """The probability that an effect of one size would have been found.

    Attributes:
        share: of its usual size; of a limit, the usual value over its own.
        value: of its first parameter.
        probability: that it would have been found.
    """

    share: float
    value: float
    probability: float


class DetectionPower(NamedTuple):
    """What the recordings would have shown of an effect that is in no set that was chosen.

    Attributes:
        name: of the effect.
        parameter: its first one, whose values are said.
        unit: of the parameter; "" for a plain number.
        usual: value at the usual size.
        least: smallest value that would have been found with a probability of 80 %; None where no size that was tried
            would.
        sizes: probabilities by size.
    """

    name: str
    parameter: str
    unit: str
    usual: float
    least: float | None
    sizes: tuple[SizePower, ...]

    @property
    def at_usual(self) -> float:
        """Probability that it would have been found at its usual size."""
        return next(size.probability for size in self.sizes if size.share == 1.0)
