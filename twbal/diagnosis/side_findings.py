"""What is asked for beside the search of effects, as `diagnosis.json` keeps it, and in sentences."""

from typing import NamedTuple

LOST, UNEQUAL = "lost_commands", "unequal_motors"
"""Effects of a simulation."""

USUAL = 1e-4
"""Density that gyros of silicon stay below [rad/s/√s].

That of the EuRoC data sets walks with 1.9e-5 (M. Burri et al.: The EuRoC micro aerial vehicle datasets, International
Journal of Robotics Research 35 (10), 2016, 1157-1163), cheap ones with some times that.
"""


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


class CommandLoss(NamedTuple):
    """Commands that did not reach the robot, which held the ones before.

    Attributes:
        share: of the commands.
        low95: lower end of its 95 % interval.
        high95: upper end.
        lost: how many of the commands that were tested are more likely lost than not.
        tested: commands that show clearly whether they are lost; others differ too little from the ones before.
    """

    share: float
    low95: float
    high95: float
    lost: int
    tested: int

    @property
    def text(self) -> str:
        """In a sentence."""
        return (
            f"The robot did not get {100 * self.share:.2g} % of its commands in time ({100 * self.low95:.2g} to "
            f"{100 * self.high95:.2g} %), and held the one before: {self.lost} of {self.tested} that show clearly "
            "(effect lost_commands, in the simulation with what was found). The other effects were searched with the "
            "commands that acted."
        )


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


def effects_of(loss: CommandLoss | None, difference: MotorDifference | None) -> dict[str, dict[str, float]]:
    """What was found, as effects of a simulation."""
    found = {LOST: loss, UNEQUAL: difference}
    return {name: {"share": each.share} for name, each in found.items() if each is not None}
