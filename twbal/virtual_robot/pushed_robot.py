"""A virtual robot that is pushed once in each rollout."""

from math import ceil

from twbal.core.plant import Observation, Plant, Pose, WheelDifference
from twbal.virtual_robot.mujoco_robot import MujocoRobot

_NEARLY = 1e-9  # of a control period: a time that is a whole number of them is not rounded up


class PushedRobot(Plant):
    """A robot that is pushed at the axle, by a constant force for a while: forward in even trials, else backward.

    Args:
        robot: it.
        time: when the push begins [s].
        duration: of the push [s], rounded to whole control periods, one at least.
        impulse: force times duration, whatever that was rounded to [N·s].

    Attributes:
        begin: control periods before the push.
        end: control periods up to its end.
    """

    turns = True

    def __init__(self, robot: MujocoRobot, time: float, duration: float, impulse: float) -> None:
        self.control_period = robot.control_period
        self._robot, self._period, self._sign = robot, 0, 1.0
        self.begin = ceil(time / robot.control_period - _NEARLY)
        self.end = self.begin + max(round(duration / robot.control_period), 1)
        self._force = impulse / ((self.end - self.begin) * robot.control_period)

    def reset(self, trial: int) -> Observation:
        """Begin the rollout."""
        self._period, self._sign = 0, -1.0 if trial % 2 else 1.0
        return self._robot.reset(trial)

    def step(self, command: float) -> Observation:
        """Drive one control period, pushed or not."""
        is_pushed = self.begin <= self._period < self.end
        self._robot.push = self._sign * self._force if is_pushed else 0.0
        self._period += 1
        return self._robot.step(command)

    def steer(self, difference: float) -> None:
        """See the robot's."""
        self._robot.steer(difference)

    def wheel_difference(self) -> WheelDifference:
        """See the robot's."""
        return self._robot.wheel_difference()

    def pose(self) -> Pose:
        """The true one."""
        return self._robot.pose()

    def stop(self) -> None:
        """See the robot's."""
        self._robot.stop()

    def close(self) -> None:
        """See the robot's."""
        self._robot.close()
