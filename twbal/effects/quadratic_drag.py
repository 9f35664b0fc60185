"""A drag that grows with the square of the speed."""

from dataclasses import dataclass

from twbal.core.robot_model import AxleMotion
from twbal.effects.effect import OutsideEffect
from twbal.effects.parameter import Scale, parameter


@dataclass(frozen=True)
class QuadraticDrag(OutsideEffect):
    """A force of coefficient·v² holds the robot back, v being its speed.

    The air does that to a robot with a sail or a large cover, and so do high grass and water. It acts at the axle.
    """

    coefficient: float = parameter(
        "force over the square of the speed",
        "N·s²/m²",
        (0.0, 60.0),
        start=4.0,
        value=12.0,
        scale=Scale.MASS,
    )
    reference = "S. F. Hoerner: Fluid-Dynamic Drag, published by the author, 1965."
    is_linear = False
    nearly_same_as = ("rolling_viscous", "viscous_friction")
    separate_by = "Drive at several speeds, also at high ones."

    def push(self, force: float, at: AxleMotion) -> float:
        """Add the drag."""
        return force - self.coefficient * at.speed * abs(at.speed)
