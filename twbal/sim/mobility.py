"""How readily the wheels turn."""

from twbal.robot.parameters import RobotParameters


def wheel_mobility(robot: RobotParameters) -> float:
    """Rate that the wheels of the upright robot gain per impulse on both from outside [1/(kg·m²)].

    The wheels roll and the body is free: c / (a c - b²) in the symbols of docs/notation.md.
    """
    m, height, r = robot.body_mass, robot.com_height, robot.wheel_radius
    a = (m + 2 * robot.wheel_mass) * r**2 + 2 * robot.wheel_inertia
    b, c = m * height * r, robot.body_inertia_pitch + m * height**2
    return c / (a * c - b**2)
