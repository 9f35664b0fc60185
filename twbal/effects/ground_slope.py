"""Ground that rises."""

from dataclasses import dataclass

from twbal.core.quantities import Quantity
from twbal.effects.effect import GroundEffect
from twbal.effects.parameter import adds_to, parameter


@dataclass(frozen=True)
class GroundSlope(GroundEffect):
    """The ground rises towards +x by `angle`.

    It acts on the wheels. Where the robot never turns round, a constant torque together with an offset of the centre of
    mass has the same effect.
    """

    angle: float = parameter(
        "of the ground, positive where it rises towards +x",
        "rad",
        (-0.2, 0.2),
        start=0.02,
        value=0.03,
        least=-1.0,
        below=1.0,
        changes=adds_to(Quantity.SLOPE),
    )
    reference = (
        "Z. Kausar, K. Stol, N. Patel: The effect of terrain inclination on performance and the stability region of "
        "two-wheeled mobile robots, International Journal of Advanced Robotic Systems 9, 2012."
    )
    is_linear = True
    nearly_same_as = ("com_offset",)
    separate_by = "Turn the robot round."
