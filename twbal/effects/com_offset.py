"""A centre of mass in front of or behind the body's axis."""

from dataclasses import dataclass, replace

from twbal.core.robot_parameters import RobotParameters
from twbal.effects.effect import BodyEffect, parameter


@dataclass(frozen=True)
class ComOffset(BodyEffect):
    """The centre of mass, seen from the axle, lies further in front by `angle`: the robot balances at tilt -angle.

    It acts on the body. It cannot be told from a tilt sensor mounted askew, nor, where the robot never turns round,
    from a slope together with a constant torque.

    Attributes:
        angle: [rad]; positive leans it forward.
    """

    angle: float = parameter("rad", -0.15, 0.15, 0.02)
    same_as = ("imu_mount_angle",)
    cannot_be_told_from = ("imu_mount_angle",)
    separate_by = "Find the tilt at which the robot balances, and measure the IMU against the body."

    def __post_init__(self) -> None:
        self._require("angle", -1.5, 1.5)

    def alter(self, robot: RobotParameters) -> RobotParameters:
        """Add to the offset."""
        return replace(robot, com_offset=robot.com_offset + self.angle)
