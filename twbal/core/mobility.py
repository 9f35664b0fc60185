"""How readily the wheels turn."""

from typing import NamedTuple

from twbal.core.robot_parameters import RobotParameters


def wheel_mobility(robot: RobotParameters) -> float:
    """Rate that the wheels of the upright robot gain per impulse on both from outside [1/(kg·m²)].

    The wheels roll and the body is free: c / (a c - b²) in the symbols of docs/notation.md.
    """
    a, b, c = _inertias(robot)
    return c / (a * c - b**2)


def joint_mobility(robot: RobotParameters) -> float:
    """Rate relative to the body that the wheels gain per impulse between them and it [1/(kg·m²)].

    As above: (a + 2 b + c) / (a c - b²).
    """
    a, b, c = _inertias(robot)
    return (a + 2 * b + c) / (a * c - b**2)


class _Inertias(NamedTuple):
    a: float
    b: float
    c: float


def _inertias(robot: RobotParameters) -> _Inertias:
    m, height, r = robot.body_mass, robot.com_height, robot.wheel_radius
    a = (m + 2 * robot.wheel_mass) * r**2 + 2 * robot.wheel_inertia
    return _Inertias(a, m * height * r, robot.body_inertia_pitch + m * height**2)
