"""Ground on which wheels roll heavily."""

from dataclasses import dataclass, replace

from twbal.core.robot_model import Ground
from twbal.effects.effect import GroundEffect, parameter


@dataclass(frozen=True)
class RollingResistance(GroundEffect):
    """The ground resists each wheel's turning with a constant torque, and holds it where less is asked.

    It acts between wheel and ground, without a reaction on the body.

    Attributes:
        torque: of each wheel [N·m].
    """

    torque: float = parameter("N·m", 0.0, 2.0, 0.1, scale="torque")
    cannot_be_told_from = ("rolling_viscous", "coulomb_friction")
    separate_by = "Let the robot roll freely, and tilt its body while the wheels stand."

    def __post_init__(self) -> None:
        self._require("torque", 0)

    def alter(self, ground: Ground) -> Ground:
        """Add to the resistance."""
        return replace(ground, rolling_resistance=ground.rolling_resistance + self.torque)
