"""Ground or air that brakes a rolling robot."""

from dataclasses import dataclass, replace

from twbal.core.robot_model import Ground
from twbal.effects.effect import GroundEffect, parameter


@dataclass(frozen=True)
class RollingViscous(GroundEffect):
    """The ground resists each wheel's turning with a torque in proportion to its rate over ground.

    It acts between wheel and ground, without a reaction on the body.

    Attributes:
        coefficient: of each wheel [N·m·s/rad].
    """

    coefficient: float = parameter("N·m·s/rad", 0.0, 0.3, 0.02, scale="torque")
    cannot_be_told_from = ("rolling_resistance", "viscous_friction")
    separate_by = "Drive at several speeds."

    def __post_init__(self) -> None:
        self._require("coefficient", 0)

    def alter(self, ground: Ground) -> Ground:
        """Add to the resistance."""
        return replace(ground, rolling_viscous=ground.rolling_viscous + self.coefficient)
