"""Dry friction in the wheels' joints."""

from dataclasses import dataclass, replace

from twbal.core.robot_model import Drive
from twbal.effects.effect import DriveEffect, parameter


@dataclass(frozen=True)
class CoulombFriction(DriveEffect):
    """Each joint resists turning with a constant torque, and sticks where less is asked of it.

    It acts between wheel and body. It can hardly be told from viscous friction on a robot that moves at one speed or
    not at all, nor from a dead zone on one that keeps moving one way.

    Attributes:
        torque: of each wheel [N·m].
    """

    torque: float = parameter("N·m", 0.0, 2.0, 0.1, scale="torque")
    cannot_be_told_from = ("viscous_friction", "dead_zone")
    separate_by = "Drive at several speeds, both ways."

    def __post_init__(self) -> None:
        self._require("torque", 0)

    def alter(self, drive: Drive) -> Drive:
        """Add to the Coulomb friction."""
        return replace(drive, coulomb_friction=drive.coulomb_friction + self.torque)
