"""Play in the gears."""

from dataclasses import dataclass
from typing import Any

from twbal.core.quantities import Quantity
from twbal.effects.effect import DriveEffect
from twbal.effects.parameter import adds_to, parameter, replaces

NORDIN = (
    "M. Nordin, P.-O. Gutman: Controlling mechanical systems with backlash - a survey, "
    "Automatica 38 (10), 2002, 1633-1649."
)
"""Reference for play."""


def gap_of(quantity: Quantity) -> Any:
    """The parameter of the width of a play."""
    return parameter(
        "full width of the gap, as an angle of the wheel",
        "rad",
        (0.0, 0.3),
        start=0.03,
        value=0.05,
        form=0.35,
        changes=adds_to(quantity),
    )


def rotor_share_of(quantity: Quantity) -> Any:
    """The parameter of what lies on the motors' side of a play."""
    return parameter(
        "share of the wheels' inertia that lies on the motors' side of the gap",
        "",
        (0.1, 0.9),
        start=0.5,
        value=0.5,
        neutral=0.5,
        least=0.01,
        below=1.0,
        changes=replaces(quantity),
        covers_all=True,
        is_optional=True,
    )


@dataclass(frozen=True)
class Backlash(DriveEffect):
    """The rotor turns freely within the gap, and meets the wheel in a plastic impact at its ends.

    It acts between motor and wheel, and the encoders sit on the wheels; for those on the motors' shafts, see
    `backlash_behind_encoder`. Of the inertia of the data sheet's wheels, `rotor_share` turns with the rotors. It looks
    most like a dead zone or a delay where the torque keeps changing its sign.
    """

    gap: float = gap_of(Quantity.GAP)
    rotor_share: float = rotor_share_of(Quantity.ROTOR_SHARE)
    reference = NORDIN
    is_linear = False
    nearly_same_as = ("dead_zone", "actuation_delay")
    never_beside = ("backlash_behind_encoder",)
    separate_by = "Lean on the robot to one side, so that the torque keeps its sign."
