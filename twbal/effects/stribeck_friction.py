"""Dry friction that is greater at rest."""

from dataclasses import dataclass, replace

from twbal.core.robot_model import Drive
from twbal.effects.effect import DriveEffect, parameter


@dataclass(frozen=True)
class StribeckFriction(DriveEffect):
    """Each joint resists turning with `torque`, and with `breakaway` more at rest.

    The bound of the friction is torque + breakaway·exp(-(ω / rate)²), ω being the wheel's rate relative to the body. It
    acts between wheel and body, and is hardly told from Coulomb friction where the robot seldom stands.

    Attributes:
        torque: of each wheel while it turns fast [N·m].
        breakaway: by which it is greater at rest [N·m].
        rate: over which that fades [rad/s].
    """

    torque: float = parameter("N·m", 0.0, 2.0, 0.1, scale="torque")
    breakaway: float = parameter("N·m", 0.0, 2.0, 0.2, scale="torque")
    rate: float = parameter("rad/s", 0.2, 10.0, 2.0, none=1.0)
    cannot_be_told_from = ("coulomb_friction",)
    separate_by = "Let the robot stand still and start again, often."

    def __post_init__(self) -> None:
        self._require("torque", 0)
        self._require("breakaway", 0)
        self._require("rate", 1e-6)

    def alter(self, drive: Drive) -> Drive:
        """Add to the dry friction."""
        return replace(
            drive,
            coulomb_friction=drive.coulomb_friction + self.torque,
            breakaway=drive.breakaway + self.breakaway,
            stribeck_rate=self.rate,
        )
