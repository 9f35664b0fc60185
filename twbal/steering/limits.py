"""How fast a person may steer a robot, and how keys are answered."""

from dataclasses import dataclass
from math import inf
from typing import Self

from twbal.core.course import GIVE_WAY
from twbal.core.errors import ConfigError
from twbal.core.motion_limits import MotionLimits
from twbal.core.robot_parameters import RobotParameters
from twbal.steering.request import Response


@dataclass(frozen=True)
class SteeringLimits:
    """What the references keep to, which are those of a course.

    Attributes:
        response: how keys are answered.
        driving: of the reference's motion along the way.
        turning: of the heading's reference.
        give_way: how far the robot may be from the reference before that gives way [m].
        turning_give_way: the same for the heading [rad].
        control_heading: whether the heading is controlled, where the robot can be turned.
    """

    response: Response
    driving: MotionLimits
    turning: MotionLimits
    give_way: float
    turning_give_way: float
    control_heading: bool

    @classmethod
    def from_settings(
        cls,
        robot: RobotParameters,
        speed_step: float,
        turn: float,
        input_timeout: float,
        hold: bool,
        stick_timeout: float,
        speed_limit: float | None = None,
        acceleration_limit: float | None = None,
        jerk_limit: float | None = None,
        give_way: float = GIVE_WAY,
        control_heading: bool = True,
        yaw_rate_limit: float | None = None,
        yaw_acceleration_limit: float | None = None,
    ) -> Self:
        """The limits that a user gives; for those of the motion see `Course.from_settings`.

        Args:
            robot: its sheet.
            speed_step: see `Response` for this and the next four.
            turn: share of the yaw rate's limit.
            input_timeout: [s].
            hold: whether the asked speed stays where no key comes.
            stick_timeout: [s].
            speed_limit: [m/s]; None: from the sheet, as the next two.
            acceleration_limit: [m/s²].
            jerk_limit: [m/s³].
            give_way: time in which a reference at the speed limit goes as far as the robot may be off [s].
            control_heading: whether the heading is controlled, where the robot can be turned.
            yaw_rate_limit: [rad/s]; None: from the sheet, as the next.
            yaw_acceleration_limit: [rad/s²].

        Raises:
            ConfigError: one cannot be right.
        """
        for name, share in (("speed_step", speed_step), ("turn", turn)):
            if not 0 < share <= 1:
                raise ConfigError(f"steering.{name} is a share of a limit, more than 0 and at most 1; found {share}.")
        times = (("input_timeout", input_timeout), ("stick_timeout", stick_timeout), ("give_way", give_way))
        for name, time in times:
            if not 0 < time < inf:
                raise ConfigError(f"steering.{name} must be a positive, finite time in s; found {time}.")
        driving = MotionLimits.of_robot(robot, speed_limit, acceleration_limit, jerk_limit)
        turning = MotionLimits.of_turning(robot, driving.speed, yaw_rate_limit, yaw_acceleration_limit)
        response = Response(speed_step, turn, input_timeout, hold, stick_timeout)
        return cls(response, driving, turning, give_way * driving.speed, give_way * turning.speed, control_heading)
