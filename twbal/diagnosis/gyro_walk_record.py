"""By how much the bias of a gyro walks, as `diagnosis.json` keeps it, and in a sentence."""

from typing import NamedTuple

WALK = "gyro_bias_walk"
"""The effect that it is in a simulation."""
USUAL = 1e-4
"""Density that gyros of silicon stay below [rad/s/√s].

That of the EuRoC data sets walks with 1.9e-5 (M. Burri et al.: The EuRoC micro aerial vehicle datasets, International
Journal of Robotics Research 35 (10), 2016, 1157-1163), cheap ones with some times that.
"""


class GyroBiasWalk(NamedTuple):
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
        """Whether it is surely more than that of a gyro that works."""
        return self.low95 > USUAL

    @property
    def text(self) -> str:
        """In a sentence."""
        said = (
            f"The bias of the gyro walks by {self.density:.2g} rad/s/√s ({self.low95:.2g} to {self.high95:.2g}); "
            f"that of a gyro of silicon walks by less than {USUAL:.0e}"
        )
        if not self.is_unusual:
            return f"{said}."
        return (
            f"{said}. So the sensor or its supply is bad, or something that no effect explains changes the measured "
            f"tilt rate over seconds (effect {WALK}, in the simulation with what was found)."
        )

    @property
    def effects(self) -> dict[str, dict[str, float]]:
        """As effects of a simulation."""
        return {WALK: {"density": self.density}}
