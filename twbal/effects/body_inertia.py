"""A body harder or easier to turn than its data sheet."""

from dataclasses import dataclass

from twbal.core.quantities import Quantity
from twbal.effects.effect import BodyEffect
from twbal.effects.parameter import parameter, scales


@dataclass(frozen=True)
class BodyInertia(BodyEffect):
    """The body's inertias about its centre of mass are `factor` times the data sheet's; its mass stays.

    It acts on the body.
    """

    factor: float = parameter(
        "true inertia over the data sheet's",
        "",
        (0.3, 3.0),
        start=1.2,
        value=1.3,
        neutral=1.0,
        least=1e-3,
        changes=scales(
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
    is_last = True
    nearly_same_as = ("com_height",)
    separate_by = "Hang the body up and time its swing."
