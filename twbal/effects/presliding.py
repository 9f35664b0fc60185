"""Dry friction that bends before it slides."""

from dataclasses import dataclass

from twbal.core.quantities import Quantity
from twbal.effects.effect import DriveEffect
from twbal.effects.parameter import adds_to, parameter


@dataclass(frozen=True)
class Presliding(DriveEffect):
    """Dry friction grows over an angle of the wheel after the wheel has turned back, as gears and tyres bend first.

    Over that angle x the friction τ changes by dτ/dx = -(F + τ sgn ẋ) / angle, F being its bound (Dahl's model). It is
    that of the joints, as with `coulomb_friction` and `stribeck_friction`, and of the ground, as with
    `rolling_resistance`. Without dry friction it does nothing.
    """

    angle: float = parameter(
        "of the wheel, over which dry friction grows to most of its bound",
        "rad",
        (0.0, 0.05),
        start=0.005,
        value=0.005,
        below=1.0,
        changes=adds_to(Quantity.PRESLIDING),
    )
    reference = "P. R. Dahl: Solid friction damping of mechanical vibrations, AIAA Journal 14 (12), 1976, 1675-1682."
    is_linear = False
    nearly_same_as = ("backlash",)
    separate_by = "Shake the robot gently about standstill, by less than the gears bend."
