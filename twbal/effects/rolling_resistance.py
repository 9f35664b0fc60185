"""Ground on which wheels roll heavily."""

from dataclasses import dataclass

from twbal.core.quantities import Quantity
from twbal.effects.effect import GroundEffect
from twbal.effects.parameter import Scale, adds_to, parameter


@dataclass(frozen=True)
class RollingResistance(GroundEffect):
    """The ground resists each wheel's turning with a constant torque, and holds it where less is asked.

    It acts between wheel and ground, without a reaction on the body.
    """

    torque: float = parameter(
        "dry resistance of each wheel",
        "N·m",
        (0.0, 2.0),
        start=0.1,
        value=0.2,
        scale=Scale.TORQUE,
        changes=adds_to(Quantity.ROLLING_RESISTANCE),
        is_of_each_wheel=True,
    )
    reference = "J. Y. Wong: Theory of Ground Vehicles, 4th ed., Wiley, 2008."
    is_linear = False
    nearly_same_as = ("rolling_viscous", "coulomb_friction")
    separate_by = "Let the robot roll freely, and tilt its body while the wheels stand."
