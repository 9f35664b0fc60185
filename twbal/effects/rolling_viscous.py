"""Ground or air that brakes a rolling robot."""

from dataclasses import dataclass

from twbal.core.quantities import Quantity
from twbal.effects.effect import GroundEffect
from twbal.effects.parameter import Scale, adds_to, parameter


@dataclass(frozen=True)
class RollingViscous(GroundEffect):
    """The ground resists each wheel's turning with a torque in proportion to its rate over ground.

    It acts between wheel and ground, without a reaction on the body.
    """

    coefficient: float = parameter(
        "resistance of each wheel over its rate",
        "N·m·s/rad",
        (0.0, 0.3),
        start=0.02,
        value=0.05,
        scale=Scale.TORQUE,
        changes=adds_to(Quantity.ROLLING_VISCOUS),
        is_of_each_wheel=True,
    )
    reference = "J. Y. Wong: Theory of Ground Vehicles, 4th ed., Wiley, 2008."
    is_linear = True
    nearly_same_as = ("rolling_resistance", "viscous_friction")
    separate_by = "Drive at several speeds."
