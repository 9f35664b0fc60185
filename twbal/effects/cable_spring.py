"""A cable that pulls the robot to a place."""

from dataclasses import dataclass
from math import inf
from typing import Any

from twbal.core.robot_model import AxleMotion
from twbal.effects.effect import OutsideEffect
from twbal.effects.parameter import Scale, parameter


def _anchor(side: str) -> Any:
    """A coordinate of the place where it is tied."""
    return parameter(
        f"where it is tied, {side} where the rollout began",
        "m",
        (-2.0, 2.0),
        start=0.0,
        value=0.0,
        least=-inf,
        sd=0.5,
        is_optional=True,
    )


@dataclass(frozen=True)
class CableSpring(OutsideEffect):
    """A spring pulls the axle to the place where it is tied to the ground, or back to where the rollout began.

    Along the heading ψ it pushes by -stiffness·((x - anchor_x)·cos ψ + (y - anchor_y)·sin ψ), x and y being the axle's
    place: ahead of where the rollout began, and to the left of that. It acts at the axle. Its pull across the heading
    is not modelled, as wheels do not slip sideways; nor is the torque by which it turns the robot, whose yaw rate is
    measured. Where a robot never turns, `anchor_y` does nothing, and `anchor_x` is a constant force.
    """

    stiffness: float = parameter(
        "pull of the cable over the distance from where it is tied",
        "N/m",
        (0.0, 100.0),
        start=5.0,
        value=10.0,
        scale=Scale.MASS,
    )
    anchor_x: float = _anchor("ahead of")
    anchor_y: float = _anchor("to the left of")
    reference = "J. P. Den Hartog: Mechanical Vibrations, 4th ed., McGraw-Hill, 1956."
    is_linear = True
    nearly_same_as = ("ground_slope",)
    separate_by = "Let the robot drive a long way."

    def push(self, force: float, at: AxleMotion) -> float:
        """Add the pull of the spring."""
        ahead, left = at.x - self.anchor_x, at.y - self.anchor_y
        return force - self.stiffness * (ahead * at.cosine + left * at.sine)
