"""A body heavier or lighter than its data sheet."""

from dataclasses import dataclass

from twbal.core.quantities import Quantity
from twbal.effects.effect import BodyEffect
from twbal.effects.parameter import parameter, scales


@dataclass(frozen=True)
class BodyMass(BodyEffect):
    """The body's mass, and its inertia with it, are `factor` times the data sheet's.

    It acts on the body. If all frictions and the wheels' masses grew alike, it would be the inverse of a torque gain.
    """

    factor: float = parameter(
        "true mass over the data sheet's",
        "",
        (0.5, 2.0),
        start=1.1,
        value=1.2,
        neutral=1.0,
        least=1e-3,
        changes=scales(
            Quantity.BODY_MASS,
            Quantity.BODY_INERTIA_PITCH,
            Quantity.BODY_INERTIA_ROLL,
            Quantity.BODY_INERTIA_YAW,
            Quantity.TURN_INERTIA,
        ),
    )
    reference = (
        "C. G. Atkeson, C. H. An, J. M. Hollerbach: Estimation of inertial parameters of manipulator loads and links, "
        "International Journal of Robotics Research 5 (3), 1986, 101-119."
    )
    nearly_same_as = ("torque_gain", "battery_sag")
    separate_by = "Weigh the body."
