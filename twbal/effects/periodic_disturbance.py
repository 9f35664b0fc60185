"""Something that shakes the robot."""

from dataclasses import dataclass
from math import pi, sin

from twbal.core.robot_model import AxleMotion
from twbal.effects.effect import OutsideEffect
from twbal.effects.parameter import Scale, parameter


@dataclass(frozen=True)
class PeriodicDisturbance(OutsideEffect):
    """A force at the axle, force·sin(2π·frequency·t + phase), t being the time since the rollout began.

    It acts at the axle.
    """

    force: float = parameter("amplitude of the force", "N", (0.0, 50.0), start=3.0, value=3.0, scale=Scale.MASS)
    frequency: float = parameter("frequency of the force", "Hz", (0.05, 12.0), start=1.0, value=1.0)
    phase: float = parameter(
        "phase when the rollout begins", "rad", (-6.3, 6.3), start=0.0, value=0.0, least=-100.0, below=100.0
    )
    reference = (
        "M. Bodson, S. C. Douglas: Adaptive algorithms for the rejection of sinusoidal disturbances with unknown "
        "frequency, Automatica 33 (12), 1997, 2213-2221."
    )
    is_linear = False
    nearly_same_as = ("cogging",)
    separate_by = "Let the robot stand where nothing moves."

    def push(self, force: float, at: AxleMotion) -> float:
        """Add the force of the moment."""
        if self.force == 0.0:
            return force
        return force + self.force * sin(2.0 * pi * self.frequency * at.time + self.phase)
