"""What of a robot is seen."""

from typing import NamedTuple, Self

from twbal.core.robot_parameters import RobotParameters


class Shape(NamedTuple):
    """A box on two wheels.

    Attributes:
        name: of the robot.
        wheel_radius: [m].
        wheel_width: [m].
        track: [m].
        com_height: above the axle, of the middle of the box [m].
    """

    name: str
    wheel_radius: float
    wheel_width: float
    track: float
    com_height: float

    @classmethod
    def of(cls, robot: RobotParameters) -> Self:
        """The shape of the robot of a sheet."""
        return cls(**{name: getattr(robot, name) for name in cls._fields})
