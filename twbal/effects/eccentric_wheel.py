"""Wheels that turn about an axle off their middle."""

from dataclasses import dataclass
from math import cos, sin

from twbal.core.robot_model import AxleMotion
from twbal.effects.effect import OutsideEffect
from twbal.effects.parameter import parameter


@dataclass(frozen=True)
class EccentricWheel(OutsideEffect):
    """The axle is off the middle of each wheel, by a share `eccentricity` of the radius.

    The robot then rises and falls once in a turn of the wheels, as on a floor with waves, and its weight M g pulls it
    into the dips: a force -M g·eccentricity·sin(angle + phase) at the axle, angle being that of the wheels in space,
    from where the encoders count. That the way of a turn varies by a share of `eccentricity`, too, is left out. The
    wheels of a robot that turns rise and fall out of step.
    """

    eccentricity: float = parameter(
        "distance of the axle from the middle of the wheel, over the radius",
        "",
        (0.0, 0.1),
        start=0.01,
        value=0.02,
        below=0.9,
    )
    phase: float = parameter("phase at angle 0", "rad", (-3.2, 3.2), start=0.0, value=0.0, least=-100.0, below=100.0)
    reference = "J. P. Den Hartog: Mechanical Vibrations, 4th ed., McGraw-Hill, 1956."
    is_linear = False
    nearly_same_as = ("ground_waves", "cogging")
    separate_by = "Begin the recording elsewhere on the floor, with the wheels turned by half a turn."

    def push(self, force: float, at: AxleMotion) -> float:
        """Add the pull of the weight, along the ground."""
        if self.eccentricity == 0.0:
            return force
        in_step = cos(at.apart * at.heading)
        return force - at.weight * self.eccentricity * in_step * sin(at.angle + self.phase)
