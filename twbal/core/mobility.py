"""How readily the wheels turn and the body falls."""

from math import cos, sin, sqrt
from typing import NamedTuple

from twbal.core.robot_parameters import GRAVITY, RobotParameters


def wheel_mobility(robot: RobotParameters) -> float:
    """Rate that the wheels of the upright robot gain per impulse on both from outside [1/(kg·m²)].

    The wheels roll and the body is free: c / (a c - b²) in the symbols of docs/notation.md.
    """
    a, b, c = inertias(robot)
    return c / (a * c - b**2)


def slip_mobility(robot: RobotParameters) -> float:
    """Rate of slip that the upright robot gains per impulse of the ground on its tyres [1/kg].

    The axle gains c / (M c - (m l)²), M being the mass of all, and the wheels turn back by themselves: r² / 2 I_w.
    """
    a, b, c = inertias(robot)
    r, spin = robot.wheel_radius, 2.0 * robot.wheel_inertia
    return r**2 * (c / ((a - spin) * c - b**2) + 1.0 / spin)


def joint_mobility(robot: RobotParameters) -> float:
    """Rate relative to the body that the wheels gain per impulse between them and it [1/(kg·m²)].

    As above: (a + 2 b + c) / (a c - b²).
    """
    a, b, c = inertias(robot)
    return (a + 2 * b + c) / (a * c - b**2)


def geared_mobilities(robot: RobotParameters, rotors: float) -> tuple[float, float]:
    """Rates that wheels and body gain per impulse between them [1/(kg·m²)]; `joint_mobility` is their difference.

    Geared rotors, whose inertia [kg·m²] is in that of the wheels, turn with the wheels relative to the body.
    """
    a, b, c = inertias(robot)
    b, c = b - rotors, c + rotors
    return (c + b) / (a * c - b**2), -(a + b) / (a * c - b**2)


def leaning_acceleration(robot: RobotParameters, lean: float) -> float:
    """Forward acceleration at which the body keeps a lean [rad], without friction [m/s²].

    Both equations of motion with θ̈ = θ̇ = 0, added up: φ̈ = m g l sinθ / (a + b cosθ), in the symbols of
    docs/notation.md; the axle moves by r φ̈.
    """
    a, b, _ = inertias(robot)
    weight = robot.body_mass * GRAVITY * robot.com_height
    return robot.wheel_radius * weight * sin(lean) / (a + b * cos(lean))


def com_speed_ratio(robot: RobotParameters) -> float:
    """Speed of the centre of mass, per speed of the axle, of an upright robot whose axle is hit: 1 - m l² / c.

    The wheels roll, and the blow is too short for torque or weight to matter. Then b φ̈ + c θ̈ = 0, so the body tips
    back by m l / c for each metre that the axle moves (symbols of docs/notation.md).
    """
    return 1.0 - robot.body_mass * robot.com_height**2 / inertias(robot).c


def acceleration_of_torque(robot: RobotParameters, torque: float) -> float:
    """Forward acceleration for which the wheels need a torque while the body keeps its lean, r u / a [m/s²].

    Args:
        robot: its sheet.
        torque: of both wheels [N·m].
    """
    return robot.wheel_radius * torque / inertias(robot).a


def falling_time(robot: RobotParameters) -> float:
    """Time in which the lean of the uncontrolled body grows e-fold while the wheels stand, √(c / (m g l)) [s]."""
    return sqrt(inertias(robot).c / (robot.body_mass * GRAVITY * robot.com_height))


def yaw_inertia(robot: RobotParameters) -> float:
    """Moment of inertia about the vertical of the upright robot whose wheels roll [kg·m²].

    J = I_yaw + 2 (I_across + m_w (b/2)²) + 2 I_w (b / 2r)² with the track b: body, wheels about the vertical, and their
    turning about the axle, at rates of ± (b / 2r) of the yaw rate. I_across = m_w (3 r² + w²) / 12, as of a disk.
    """
    r, mass, half = robot.wheel_radius, robot.wheel_mass, 0.5 * robot.track
    across = mass * (3.0 * r**2 + robot.wheel_width**2) / 12.0
    return robot.body_inertia_yaw + 2.0 * (across + mass * half**2) + 2.0 * robot.wheel_inertia * (half / r) ** 2


def yaw_mobility(robot: RobotParameters) -> float:
    """Yaw acceleration per N·m of the wheel torques' difference, b / (2 r J) with the track b [1/(kg·m²)]."""
    return robot.track / (2.0 * robot.wheel_radius * yaw_inertia(robot))


class Inertias(NamedTuple):
    """Of the equations of motion, in the symbols of docs/notation.md [kg·m²]."""

    a: float
    b: float
    c: float


def inertias(robot: RobotParameters) -> Inertias:
    """What the wheels turn, a, what couples them to the body, b, and the body about the axle, c."""
    m, height, r = robot.body_mass, robot.com_height, robot.wheel_radius
    a = (m + 2 * robot.wheel_mass) * r**2 + 2 * robot.wheel_inertia
    return Inertias(a, m * height * r, robot.body_inertia_pitch + m * height**2)
