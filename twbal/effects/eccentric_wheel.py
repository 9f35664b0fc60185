"""Wheels that turn about an axle off their middle."""

from dataclasses import dataclass
from math import cos, sin

from twbal.core.robot_model import AxleMotion
from twbal.core.robot_parameters import GRAVITY
from twbal.effects.effect import OutsideEffect
from twbal.effects.parameter import parameter


@dataclass(frozen=True)
class EccentricWheel(OutsideEffect):
    """The axle is off the middle of each wheel, by a share `eccentricity` of the radius.

    The robot then rises and falls once in a turn of the wheels, as on a floor with waves, and its weight M g pulls it
    into the dips. Its mass M goes faster where the axle is high, which takes a force, too. With the angle φ of the
    wheels in space, from where the encoders count, and the speed v, both together are a force at the axle,
    -M (g + v φ')·eccentricity·sin(φ + phase), to first order (Lagrange's equation of a mass at the axle, where the
    wheels turn evenly). Left out is that in a turn the inertia varies by 2·`eccentricity`, so that a robot that speeds
    up and slows down much seems to have some more of it, and a little cogging once a turn. The wheels of a robot that
    turns rise and fall out of step.
    """

    eccentricity: float = parameter(
        "distance of the axle from the middle of the wheel, over the radius",
        "",
        (0.0, 0.1),
        start=0.01,
        value=0.02,
        below=0.9,
    )
    phase: float = parameter("phase at angle 0", "rad", (-6.3, 6.3), start=0.0, value=0.0, least=-100.0, below=100.0)
    reference = "J. P. Den Hartog: Mechanical Vibrations, 4th ed., McGraw-Hill, 1956."
    is_linear = False
    nearly_same_as = ("ground_waves", "cogging")
    separate_by = "Begin the recording elsewhere on the floor, with the wheels turned by half a turn."

    def push(self, force: float, at: AxleMotion) -> float:
        """Add the pull of weight and inertia, along the ground."""
        if self.eccentricity == 0.0:
            return force
        in_step = cos(at.apart * at.heading)
        pull = at.weight * (1.0 + at.speed * at.rate / GRAVITY)
        return force - pull * self.eccentricity * in_step * sin(at.angle + self.phase)
