"""Play in the gears that encoders on the motors' shafts do not see."""

from dataclasses import dataclass

from twbal.core.quantities import Quantity
from twbal.effects.backlash import GRID, NORDIN, contact_damping_of, contact_time_of, gap_of, rotor_share_of
from twbal.effects.effect import DriveEffect


@dataclass(frozen=True)
class BacklashBehindEncoder(DriveEffect):
    """Play between the motors' shafts, on which the encoders sit, and the wheels.

    The gears are those of the effect `backlash`: the rotor turns freely within the gap, and meets the wheel at its
    ends. But the encoders see the rotors. While these cross the gap, they turn and the robot does
    not. Most small gear motors have their encoders there, behind the motor.
    """

    gap: float = gap_of(Quantity.SHAFT_GAP)
    rotor_share: float = rotor_share_of(Quantity.SHAFT_ROTOR_SHARE)
    contact_time: float = contact_time_of(Quantity.SHAFT_CONTACT_TIME)
    contact_damping: float = contact_damping_of(Quantity.SHAFT_CONTACT_DAMPING)
    reference = NORDIN
    is_linear = False
    nearly_same_as = ("backlash", "dead_zone", "actuation_delay")
    never_beside = ("backlash",)
    tried_at = GRID
    separate_by = "Block the wheels and turn the motors to and fro: the encoders count the play."
