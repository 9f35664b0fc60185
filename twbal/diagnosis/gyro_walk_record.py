"""By how much the bias of a gyro walks, as `diagnosis.json` keeps it, and in a sentence."""

from typing import NamedTuple

USUAL = 1e-4
"""Density that gyros of silicon stay below [rad/s/√s].

That of the EuRoC data sets walks with 1.9e-5 (M. Burri et al.: The EuRoC micro aerial vehicle datasets, International
Journal of Robotics Research 35 (10), 2016, 1157-1163), cheap ones with some times that.
"""


class BiasWalk(NamedTuple):
    """By how much the bias of the gyro walks.

    Attributes:
        density: [rad/s/√s].
        low95: lower end of its 95 % interval.
        high95: upper end.
    """

    density: float
    low95: float
    high95: float

    @property
    def is_unusual(self) -> bool:
        """Whether the interval lies above what a gyro that works has."""
        return self.low95 > USUAL

    @property
    def text(self) -> str:
        """In a sentence."""
        said = f"The bias of the gyro walks by {self.density:.2g} rad/s/√s ({self.low95:.2g} to {self.high95:.2g})"
        usual = f"that of a gyro of silicon walks by less than {USUAL:.0e}"
        if not self.is_unusual:
            return f"{said}; {usual}."
        return f"{said}, or something else changes the measured tilt rate over seconds; {usual}."
