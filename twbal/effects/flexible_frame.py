"""A frame that yields."""

from dataclasses import dataclass

from twbal.core.quantities import Quantity
from twbal.effects.effect import BodyEffect
from twbal.effects.parameter import adds_to, parameter, replaces


@dataclass(frozen=True)
class FlexibleFrame(BodyEffect):
    """The upper part of the body swings fore and aft, as a mass on a spring, while motors and IMU are on the lower one.

    The part has a share of the body's mass. Its distance y from where a rigid frame would hold it obeys
    y'' + 2·damping·ω·y' + ω²·y = g·sin α - v'·cos α - h·θ'', with ω = 2π·frequency, its height h above the axle, the
    angle α of the centre of mass from the vertical, and the axle's speed v. The spring pushes back on the rest of the
    body. It acts on the body. With the rest of the body free to move the robot rings faster than at `frequency`. The
    planar model takes y for small beside the body.
    """

    share: float = parameter(
        "share of the body's mass that swings",
        "",
        (0.0, 0.2),
        start=0.1,
        value=0.1,
        below=1.0,
        changes=adds_to(Quantity.SWINGING_SHARE),
    )
    frequency: float = parameter(
        "at which it would swing if the rest stood still",
        "Hz",
        (1.5, 15.0),  # the robot rings faster: near half of a rate of 50 Hz, any error of form looks like it
        start=5.0,
        value=5.0,
        neutral=5.0,
        least=0.1,
        below=25.0,
        changes=replaces(Quantity.SWING_FREQUENCY),
    )
    damping: float = parameter(
        "damping ratio of the swing",
        "",
        (0.005, 0.3),
        start=0.15,
        value=0.05,
        neutral=0.05,
        below=1.0,
        changes=replaces(Quantity.SWING_DAMPING),
    )
    height: float = parameter(
        "height of that part above the axle, over that of the centre of mass",
        "",
        (1.0, 2.0),
        start=1.8,
        value=1.8,
        neutral=1.8,
        below=10.0,
        changes=replaces(Quantity.SWING_HEIGHT),
        covers_all=True,
    )
    reference = "L. Meirovitch: Fundamentals of Vibrations, McGraw-Hill, 2001."
    is_linear = False
    separate_by = "Block the wheels, tap the top of the body, and look at which frequency the gyro rings."
