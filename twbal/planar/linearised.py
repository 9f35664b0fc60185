"""The robot's motion about its balance, linearised."""

from typing import NamedTuple

import numpy as np
import scipy.linalg

from twbal.core.gaussian import Array
from twbal.core.robot_parameters import RobotParameters
from twbal.planar.equations import coefficients


class LinearModel(NamedTuple):
    """ẋ = A x + B u in continuous time, or x' = A x + B u from one control period to the next.

    x = (tilt - balance, tilt rate, speed) in rad, rad/s, m/s; u in N·m.

    Attributes:
        A: (3, 3).
        B: (3,).
    """

    A: Array
    B: Array


def linearise(robot: RobotParameters) -> LinearModel:
    """Linearise the equations of motion of `dynamics` about standing still at the balance, tilt = -com_offset."""
    k = coefficients(robot)
    determinant = k.a * k.c - k.b**2
    r = robot.wheel_radius
    A = np.zeros((3, 3))
    A[0, 1] = 1.0
    A[1, 0] = k.a * k.d / determinant
    A[2, 0] = -r * k.b * k.d / determinant
    B = np.array([0.0, -(k.a + k.b) / determinant, r * (k.c + k.b) / determinant])
    return LinearModel(A, B)


def sampled(robot: RobotParameters) -> LinearModel:
    """The same over one control period, the command being held: x' = A x + B u."""
    A, B = linearise(robot)
    both = scipy.linalg.expm(robot.control_period * np.block([[A, B[:, None]], [np.zeros((1, 4))]]))
    return LinearModel(both[:3, :3], both[:3, 3])
