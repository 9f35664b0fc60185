"""The equations of `twbal.planar.equations`, solved for the accelerations."""

from math import cos, sin
from typing import NamedTuple

from twbal.planar.equations import Coefficients


class Accelerations(NamedTuple):
    """Second derivatives φ̈, θ̈ [rad/s²]."""

    wheel: float
    tilt: float


def accelerations(k: Coefficients, tilt: float, tilt_rate: float, torque: float) -> Accelerations:
    """Solve the equations of motion.

    Args:
        k: constants of the robot.
        tilt: θ [rad].
        tilt_rate: [rad/s].
        torque: τ, on both wheels together [N·m].
    """
    alpha = tilt + k.offset
    coupling = k.b * cos(alpha)
    on_wheels = torque + k.b * sin(alpha) * tilt_rate**2
    on_body = k.d * sin(alpha) - torque
    determinant = k.a * k.c - coupling**2
    return Accelerations(
        wheel=(k.c * on_wheels - coupling * on_body) / determinant,
        tilt=(k.a * on_body - coupling * on_wheels) / determinant,
    )
