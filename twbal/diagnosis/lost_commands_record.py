"""How many commands a robot did not get, as `diagnosis.json` keeps it, and in a sentence."""

from typing import NamedTuple

LOST = "lost_commands"
"""The effect that it is in a simulation."""


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

    @property
    def effects(self) -> dict[str, dict[str, float]]:
        """As effects of a simulation."""
        return {LOST: {"share": self.share}}
