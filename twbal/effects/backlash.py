"""Play in the gears."""

from dataclasses import dataclass, replace

from twbal.core.robot_model import Drive
from twbal.effects.effect import DriveEffect, parameter


@dataclass(frozen=True)
class Backlash(DriveEffect):
    """The rotor turns freely within the gap, and meets the wheel in a plastic impact at its ends.

    It acts between motor and wheel, with `ROTOR_SHARE` of the wheels' inertia on the motors' side.
    It is hardly told from a dead zone or a delay on a robot whose torque keeps changing sign.

    Attributes:
        gap: full width, in turns of the wheel [rad].
    """

    gap: float = parameter("rad", 0.0, 0.3, 0.03)
    cannot_be_told_from = ("dead_zone", "actuation_delay")
    separate_by = "Lean on the robot to one side, so that the torque keeps its sign."

    def __post_init__(self) -> None:
        self._require("gap", 0)

    def alter(self, drive: Drive) -> Drive:
        """Add to the gap."""
        return replace(drive, gap=drive.gap + self.gap)
