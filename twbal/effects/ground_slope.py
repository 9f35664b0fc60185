"""Ground that rises."""

from dataclasses import dataclass, replace

from twbal.core.robot_model import Ground
from twbal.effects.effect import GroundEffect, parameter


@dataclass(frozen=True)
class GroundSlope(GroundEffect):
    """The ground rises towards +x by `angle`.

    It acts on the wheels. On a robot that never turns round it cannot be told from a constant torque together with an
    offset of the centre of mass.

    Attributes:
        angle: [rad].
    """

    angle: float = parameter("rad", -0.2, 0.2, 0.02)
    cannot_be_told_from = ("com_offset",)
    separate_by = "Turn the robot round."

    def __post_init__(self) -> None:
        self._require("angle", -1.0, 1.0)

    def alter(self, ground: Ground) -> Ground:
        """Add to the slope."""
        return replace(ground, slope=ground.slope + self.angle)
