"""How fast a reference may move, by default from a robot's sheet."""

from dataclasses import dataclass, fields
from math import inf, radians, sqrt
from typing import Self

from twbal.core.errors import ConfigError
from twbal.core.mobility import acceleration_of_torque, falling_time, leaning_acceleration, yaw_mobility
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
SIDEWAYS = 0.25
"""Part of the sideways acceleration at which the robot would tip over that a bend at the speed limit may take."""
TURNING_SHARE = 0.25
"""Of the torque limit: largest difference of the wheel torques that is to move the robot; what friction takes comes on
top (`heading_control.FRICTION_SHARE`). Half of it accelerates the reference at most."""


@dataclass(frozen=True)
class MotionLimits:
    """What a motion keeps to, either way; along a line in m, or about the vertical in rad.

    Attributes:
        speed: [m/s] or [rad/s].
        acceleration: [m/s²] or [rad/s²].
        jerk: rate of the acceleration [m/s³] or [rad/s³].

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
        lean: float = LEAN,
    ) -> Self:
        """The limits that are given, and from the sheet those that are None.

        v = √(0.25 g (l + r)); a is the acceleration with a lean (of 5° if not told otherwise), or that of a quarter of
        the torque limit where this is less; the jerk reaches a within 2 √(c / (m g l)), c being the body's inertia
        about the axle.

        Args:
            robot: its sheet.
            speed: [m/s].
            acceleration: [m/s²].
            jerk: [m/s³].
            lean: by which an acceleration that is not given leans the body [rad].
        """
        if speed is None:
            speed = sqrt(FROUDE_NUMBER * GRAVITY * (robot.com_height + robot.wheel_radius))
        if acceleration is None:
            strongest = acceleration_of_torque(robot, TORQUE_SHARE * robot.torque_limit)
            acceleration = min(leaning_acceleration(robot, lean), strongest)
        if jerk is None:
            jerk = acceleration / (RAMP_TIME * falling_time(robot))
        return cls(speed, acceleration, jerk)

    @classmethod
    def of_turning(
        cls,
        robot: RobotParameters,
        speed: float,
        yaw_rate: float | None = None,
        yaw_acceleration: float | None = None,
    ) -> Self:
        """Limits of the heading: those that are given, and from the sheet those that are None.

        The yaw rate is that at which a bend at `speed` takes a quarter of the sideways acceleration that tips the robot
        over, g (b/2) / (l + r), and at most that at which a wheel alone runs at half that speed. The acceleration
        reaches it within 2 √(c / (m g l)), and needs an eighth of the torque limit at most; the jerk reaches the
        acceleration in half that time. From rest a turn so has its full rate after 3 √(c / (m g l)), or later where the
        torque limits it.

        Args:
            robot: its sheet.
            speed: limit of its motion straight ahead [m/s].
            yaw_rate: [rad/s].
            yaw_acceleration: [rad/s²].
        """
        ramp, half = RAMP_TIME * falling_time(robot), 0.5 * robot.track
        if yaw_rate is None:
            sideways = SIDEWAYS * GRAVITY * half / (robot.com_height + robot.wheel_radius)
            yaw_rate = min(sideways / speed, 0.5 * speed / half)
        if yaw_acceleration is None:
            strongest = 0.5 * TURNING_SHARE * robot.torque_limit * yaw_mobility(robot)
            yaw_acceleration = min(yaw_rate / ramp, strongest)
        return cls(yaw_rate, yaw_acceleration, yaw_acceleration / (0.5 * ramp))
