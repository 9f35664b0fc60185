"""States that a policy meets while it balances, for checks and for fits of smaller policies."""

from collections.abc import Sequence
from math import pi, sqrt

import numpy as np

from twbal.core.gaussian import Array
from twbal.core.robot_parameters import GRAVITY, RobotParameters

_REACH = 10.0  # wheel radii; position either way
_SHARES = (1.0, 0.3, 0.1, 0.03)  # of the range, a quarter of the states each: most of a rollout is spent near rest


def half_widths(names: Sequence[str], longest: float, robot: RobotParameters, tilt_limit: float) -> Array:
    """How far each channel goes either way, (D,).

    Tilt to its limit; tilt rate and speed as of a pendulum of the robot's height that falls there; the commands to the
    torque limit; the position ten wheel radii, and its integral to its bound.

    Args:
        names: of the D channels.
        longest: bound of the position's integral [m·s].
        robot: its sheet.
        tilt_limit: [rad].
    """
    height = robot.com_height + robot.wheel_radius
    widths = {
        "tilt": tilt_limit,
        "tilt_rate": 2.0 * tilt_limit * sqrt(GRAVITY / height),
        "acceleration": GRAVITY,
        "speed": sqrt(GRAVITY * height),
        "yaw_rate": pi,
        "position": _REACH * robot.wheel_radius,
        "position_integral": longest,
    }
    return np.array([widths.get(name, robot.torque_limit) for name in names])


def sampled_states(widths: Array, count: int, rng: np.random.Generator) -> Array:
    """States (count, D) that single precision holds exactly, uniform in boxes of four sizes about rest."""
    shares = rng.choice(_SHARES, size=(count, 1))
    states: Array = (widths * shares * rng.uniform(-1.0, 1.0, (count, len(widths)))).astype(np.float32)
    return states.astype(np.float64)
