"""By how much one motor is stronger than the other, as `diagnosis.json` keeps it, and in a sentence."""

from typing import NamedTuple

UNEQUAL = "unequal_motors"
"""The effect that it is in a simulation."""


class MotorDifference(NamedTuple):
    """By how much the right motor is stronger.

    Attributes:
        share: than the mean of both.
        low95: lower end of its 95 % interval, with what the data sheet's yaw inertia may be off by.
        high95: upper end.
    """

    share: float
    low95: float
    high95: float

    @property
    def text(self) -> str:
        """In a sentence."""
        side, other = ("right", "left") if self.share > 0.0 else ("left", "right")
        size, ends = abs(self.share), sorted((abs(self.low95), abs(self.high95)))
        return (
            f"The robot turns with the command: the {side} motor gives {size:.0%} ({ends[0]:.0%} to {ends[1]:.0%}) "
            f"more torque than the mean of both (effect unequal_motors, in the simulation with what was found), or the "
            f"centre of mass lies to the {other}."
        )

    @property
    def effects(self) -> dict[str, dict[str, float]]:
        """As effects of a simulation."""
        return {UNEQUAL: {"share": self.share}}
