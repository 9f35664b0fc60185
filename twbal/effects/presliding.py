"""Dry friction that bends before it slides."""

from dataclasses import dataclass

from twbal.core.quantities import Quantity
from twbal.effects.effect import DriveEffect
from twbal.effects.parameter import adds_to, parameter


@dataclass(frozen=True)
class Presliding(DriveEffect):
    """Dry friction grows over an angle of the wheel once it turns back: gears and tyres bend before they slide.

    Over that angle x the friction τ of a wheel changes by dτ/dx = -(S / angle)·(1 + (τ / F)·sgn ẋ), F being its bound
    and S its bound at rest. It is the friction of the joints, by `coulomb_friction` or `stribeck_friction`, and of the
    ground, by `rolling_resistance`. Without any of these it does nothing. It looks most like a narrow backlash.
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
    acts_on = ("coulomb_friction", "stribeck_friction", "rolling_resistance")
    separate_by = "Shake the robot gently about standstill, by less than the gears bend."
