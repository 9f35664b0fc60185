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


GRID = {
    "gap": (0.003, 0.004, 0.0055, 0.0076, 0.0105, 0.0145, 0.02, 0.0275, 0.038, 0.053, 0.073, 0.1),
    "rotor_share": (0.2, 0.35, 0.5, 0.65, 0.8),
    "contact_time": (0.003, 0.008),
    "contact_damping": (0.2, 0.4),
}
"""At which play is tried: when the rotors meet the wheels, and how fast, depends on all of these. Where the width, the
share or the damping is off by a fifth to a third, the others gain little or nothing."""


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


def contact_time_of(quantity: Quantity) -> Any:
    """The parameter of how far the gears bend."""
    return parameter(
        "for which an impact of the rotors on wheels that stand still lasts without damping; 0: on rigid gears",
        "s",
        (0.0, 0.03),
        start=0.004,
        value=0.0,
        changes=adds_to(quantity),
        sd=0.006,
        is_optional=True,
    )


def contact_damping_of(quantity: Quantity) -> Any:
    """The parameter of how well the gears damp an impact."""
    return parameter(
        "damping of that impact, over critical damping",
        "",
        (0.0, 2.0),
        start=0.4,
        value=0.4,
        neutral=0.4,
        changes=replaces(quantity),
        covers_all=True,
        sd=0.25,
        is_optional=True,
    )


@dataclass(frozen=True)
class Backlash(DriveEffect):
    """The rotor turns freely within the gap, and meets the wheel at its ends.

    Gears and shafts bend: there they are a spring and a damper that push and never pull. Against wheels that stand
    still, the rotors alone would be thrown back after the `contact_time` T: the spring's stiffness is (π / T)² times
    their inertia. With `contact_time` 0 it is rigid, and the impact plastic.
    It acts between motor and wheel, and the encoders sit on the wheels; for those on the motors' shafts, see
    `backlash_behind_encoder`. Of the inertia of the data sheet's wheels, `rotor_share` turns with the rotors, and that
    of the effect `rotor_inertia` is theirs as far as this allows. It looks most like a dead zone or a delay where the
    torque keeps changing its sign.
    """

    gap: float = gap_of(Quantity.GAP)
    rotor_share: float = rotor_share_of(Quantity.ROTOR_SHARE)
    contact_time: float = contact_time_of(Quantity.CONTACT_TIME)
    contact_damping: float = contact_damping_of(Quantity.CONTACT_DAMPING)
    reference = NORDIN
    is_linear = False
    nearly_same_as = ("dead_zone", "actuation_delay")
    never_beside = ("backlash_behind_encoder",)
    tried_at = GRID
    separate_by = "Lean on the robot to one side, so that the torque keeps its sign."
