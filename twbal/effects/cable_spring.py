"""A cable that pulls the robot back."""

from dataclasses import dataclass

from twbal.core.robot_model import AxleMotion
from twbal.effects.effect import OutsideEffect
from twbal.effects.parameter import Scale, parameter


@dataclass(frozen=True)
class CableSpring(OutsideEffect):
    """A spring pulls the axle back to where the rollout began.

    It acts at the axle.
    """

    stiffness: float = parameter(
        "pull of the cable over the distance from the start",
        "N/m",
        (0.0, 100.0),
        start=5.0,
        value=10.0,
        scale=Scale.MASS,
    )
    reference = "J. P. Den Hartog: Mechanical Vibrations, 4th ed., McGraw-Hill, 1956."
    is_linear = True
    nearly_same_as = ("ground_slope",)
    separate_by = "Let the robot drive a long way."

    def push(self, force: float, at: AxleMotion) -> float:
        """Add the pull of the spring."""
        return force - self.stiffness * at.position
