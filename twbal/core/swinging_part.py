"""The part of the body that swings on a frame that yields, as a body of its own."""

from dataclasses import replace
from math import pi
from typing import NamedTuple

from twbal.core.errors import ConfigError
from twbal.core.robot_model import RobotModel
from twbal.core.robot_parameters import RobotParameters


class SwingingPart(NamedTuple):
    """A mass on a spring, on the line from the axle to the body's centre of mass, that slides across it.

    Attributes:
        mass: [kg].
        height: above the axle, along that line [m].
        stiffness: of the spring [N/m].
        damping: of the spring [N·s/m].
    """

    mass: float
    height: float
    stiffness: float
    damping: float

    def force(self, sway: float, rate: float) -> float:
        """What the spring pushes the part forward with [N], at its distance from rest [m] and rate [m/s]."""
        return -self.stiffness * sway - self.damping * rate


def swinging_part(model: RobotModel) -> SwingingPart | None:
    """What of a robot's body swings; None where its frame is rigid."""
    frame = model.frame
    if frame.swinging_share == 0.0:
        return None
    mass, pace = frame.swinging_share * model.robot.body_mass, 2.0 * pi * frame.swing_frequency
    height = frame.swing_height * model.robot.com_height
    return SwingingPart(mass, height, mass * pace**2, 2.0 * frame.swing_damping * mass * pace)


def without_part(robot: RobotParameters, part: SwingingPart) -> RobotParameters:
    """The rest of the body: with the part at rest, both together have the robot's mass, centre of mass and inertia.

    Raises:
        ConfigError: no rest of a body can be so light in one place and heavy in another.
    """
    mass = robot.body_mass - part.mass
    height = (robot.body_mass * robot.com_height - part.mass * part.height) / mass
    less = mass * height**2 + part.mass * part.height**2 - robot.body_mass * robot.com_height**2
    pitch, roll = robot.body_inertia_pitch - less, robot.body_inertia_roll - less
    if not (min(pitch, roll) > 0.0 and pitch + roll >= robot.body_inertia_yaw):  # an engine takes those for none
        raise ConfigError(
            f"A part of {part.mass:.3g} kg that swings {part.height:.3g} m above the axle has {less:.3g} kg·m² of the "
            f"body's moments of inertia, which are {robot.body_inertia_pitch:.3g} kg·m² (pitch) and "
            f"{robot.body_inertia_roll:.3g} kg·m² (roll) in all; the rest would be no body. Choose a smaller share or "
            "height of the effect flexible_frame."
        )
    return replace(robot, body_mass=mass, com_height=height, body_inertia_pitch=pitch, body_inertia_roll=roll)
