r"""Equations of motion of a wheeled inverted pendulum in its plane.

Coordinates are the tilt θ of the body from the vertical and the angle φ that the wheels have turned in space (not
relative to the body); the wheels roll without slip, so the axle moves by r φ. The centre of mass stands at the angle
α = θ + δ from the vertical, δ being the robot's `com_offset`, at the distance l from the axle. With m, I the body's
mass and inertia about its centre of mass and m_w, I_w those of each wheel, the kinetic and potential energies are

    T = ½ a φ̇² + b cos α φ̇ θ̇ + ½ c θ̇²,   V = d cos α,
    a = (m + 2 m_w) r² + 2 I_w,   b = m l r,   c = I + m l²,   d = m g l,

and the torque τ, summed over both wheels, acts on the wheels and backwards on the body. Lagrange's equations are

    a φ̈ + b cos α θ̈ - b sin α θ̇² = τ
    b cos α φ̈ + c θ̈ - d sin α = -τ.

Positive θ leans forward, positive φ rolls forward.
"""

from typing import NamedTuple

from twbal.core.robot_parameters import GRAVITY, RobotParameters


class Coefficients(NamedTuple):
    """The constants a, b, c [kg·m²], d [N·m] of the equations of motion, and δ [rad]."""

    a: float
    b: float
    c: float
    d: float
    offset: float


def coefficients(robot: RobotParameters) -> Coefficients:
    """The constants of a robot's equations of motion."""
    m, height, r = robot.body_mass, robot.com_height, robot.wheel_radius
    return Coefficients(
        a=(m + 2 * robot.wheel_mass) * r**2 + 2 * robot.wheel_inertia,
        b=m * height * r,
        c=robot.body_inertia_pitch + m * height**2,
        d=m * GRAVITY * height,
        offset=robot.com_offset,
    )
