"""A centre of mass higher or lower than the data sheet's."""

from dataclasses import dataclass

from twbal.core.quantities import Quantity
from twbal.effects.effect import BodyEffect
from twbal.effects.parameter import parameter, scales


@dataclass(frozen=True)
class ComHeight(BodyEffect):
    """The centre of mass is `factor` times as far from the axle; the inertia about it stays.

    It acts on the body.
    """

    factor: float = parameter(
        "true height over the data sheet's",
        "",
        (0.5, 2.0),
        start=1.1,
        value=1.2,
        neutral=1.0,
        least=1e-3,
        changes=scales(Quantity.COM_HEIGHT),
    )
    reference = (
        "C. G. Atkeson, C. H. An, J. M. Hollerbach: Estimation of inertial parameters of manipulator loads and links, "
        "International Journal of Robotics Research 5 (3), 1986, 101-119."
    )
    nearly_same_as = ("wheel_radius",)
    separate_by = "Measure the wheels, or hang the body up and time its swing."
