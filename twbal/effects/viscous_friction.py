"""Friction in the wheels' joints that grows with their rate."""

from dataclasses import dataclass, replace

from twbal.core.robot_model import Drive
from twbal.effects.effect import DriveEffect, parameter


@dataclass(frozen=True)
class ViscousFriction(DriveEffect):
    """Each joint resists turning with a torque in proportion to the wheel's rate relative to the body.

    It acts between wheel and body. It cannot be told from the motors' back-EMF, and hardly from Coulomb friction on a
    robot that moves at one speed.

    Attributes:
        coefficient: of each wheel [N·m·s/rad].
    """

    coefficient: float = parameter("N·m·s/rad", 0.0, 0.3, 0.02, scale="torque")
    cannot_be_told_from = ("coulomb_friction",)
    separate_by = "Drive at several speeds."

    def __post_init__(self) -> None:
        self._require("coefficient", 0)

    def alter(self, drive: Drive) -> Drive:
        """Add to the viscous friction."""
        return replace(drive, viscous_friction=drive.viscous_friction + self.coefficient)
