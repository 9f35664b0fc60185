"""How fast a reference may move, by default from a robot's sheet."""

from dataclasses import dataclass, fields
from math import inf, radians, sqrt
from typing import Self

from twbal.core.errors import ConfigError
from twbal.core.mobility import acceleration_of_torque, falling_time, leaning_acceleration
from twbal.core.robot_parameters import GRAVITY, RobotParameters

FROUDE_NUMBER = 0.25
"""v² / (g h) at the fastest, h being the height of the centre of mass above the ground: speeds of robots of different
sizes are alike where this number is (Alexander, The gaits of bipedal and quadrupedal animals, 1984)."""
LEAN = radians(5.0)
"""Of the body at the greatest acceleration [rad]."""
TORQUE_SHARE = 0.25
"""Of the torque limit, which that acceleration may take; the rest is left for balancing."""
RAMP_TIME = 2.0
"""Shortest time from no acceleration to the greatest, in times in which the robot falls."""


@dataclass(frozen=True)
class MotionLimits:
    """What a motion keeps to, either way.

    Attributes:
        speed: [m/s].
        acceleration: [m/s²].
        jerk: rate of the acceleration [m/s³].

    Raises:
        ConfigError: one is not a positive number.
    """

    speed: float
    acceleration: float
    jerk: float

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not 0 < value < inf:
                raise ConfigError(f"A reference needs a positive, finite limit of its {field.name}; found {value}.")

    @classmethod
    def of_robot(
        cls,
        robot: RobotParameters,
        speed: float | None = None,
        acceleration: float | None = None,
        jerk: float | None = None,
    ) -> Self:
        """The limits that are given, and from the sheet those that are None.

        v = √(0.25 g (l + r)); a is the acceleration with a lean of 5°, or that of a quarter of the torque limit where
        this is less; the jerk reaches a within 2 √(c / (m g l)), c being the body's inertia about the axle.

        Args:
            robot: its sheet.
            speed: [m/s].
            acceleration: [m/s²].
            jerk: [m/s³].
        """
        if speed is None:
            speed = sqrt(FROUDE_NUMBER * GRAVITY * (robot.com_height + robot.wheel_radius))
        if acceleration is None:
            strongest = acceleration_of_torque(robot, TORQUE_SHARE * robot.torque_limit)
            acceleration = min(leaning_acceleration(robot, LEAN), strongest)
        if jerk is None:
            jerk = acceleration / (RAMP_TIME * falling_time(robot))
        return cls(speed, acceleration, jerk)
