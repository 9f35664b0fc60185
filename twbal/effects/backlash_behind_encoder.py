"""Play in the gears that encoders on the motors' shafts do not see."""

from dataclasses import dataclass

from twbal.core.quantities import Quantity
from twbal.effects.effect import DriveEffect
from twbal.effects.parameter import adds_to, parameter, replaces


@dataclass(frozen=True)
class BacklashBehindEncoder(DriveEffect):
    """Play between the motors' shafts, on which the encoders sit, and the wheels.

    The gears are those of the effect `backlash`: the rotor turns freely within the gap, and meets the wheel in a
    plastic impact at its ends. But the encoders see the rotors. While these cross the gap, they turn and the robot does
    not. Most small gear motors have their encoders there, behind the motor.
    """

    gap: float = parameter(
        "full width of the gap, as an angle of the wheel",
        "rad",
        (0.0, 0.3),
        start=0.03,
        value=0.05,
        form=0.35,
        changes=adds_to(Quantity.SHAFT_GAP),
    )
    rotor_share: float = parameter(
        "share of the wheels' inertia that lies on the motors' side of the gap",
        "",
        (0.1, 0.9),
        start=0.5,
        value=0.5,
        neutral=0.5,
        least=0.01,
        below=1.0,
        changes=replaces(Quantity.SHAFT_ROTOR_SHARE),
        covers_all=True,
    )
    reference = (
        "M. Nordin, P.-O. Gutman: Controlling mechanical systems with backlash - a survey, "
        "Automatica 38 (10), 2002, 1633-1649."
    )
    is_linear = False
    nearly_same_as = ("backlash", "dead_zone", "actuation_delay")
    separate_by = "Block the wheels and turn the motors to and fro: the encoders count the play."
