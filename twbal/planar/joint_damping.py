"""How fast viscous friction in the joints slows wheel and body down against each other."""

from math import cos

from twbal.planar.constants import constants
from twbal.planar.parameters import PlanarParameters


def joint_damping_rate(p: PlanarParameters) -> float:
    """The rate at which viscous friction in the joints lets wheels and upright body come to turn alike [1/s].

    An explicit integration is stable with steps of less than 2 over this rate, and exact to 10 % with 0.2 over it. It
    is high where a strong back-EMF acts on light wheels.

    Args:
        p: the planar model.
    """
    k = constants(p, 1.0)
    a, coupling = k.a - k.play.rotors, k.b * cos(k.offset) - k.geared
    inverse_inertia = (k.c + 2.0 * coupling + a) / (a * k.c - coupling * coupling)
    return 2.0 * k.viscous * inverse_inertia
