"""A robot that is pushed once on its way."""

from benchmarks.driving.tasks import Push
from twbal.core.plant import Observation, Plant, Pose, WheelDifference
from twbal.virtual_robot.mujoco_robot import MujocoRobot

DURATION = 0.1  # of a push [s]


class PushedOnce(Plant):
    """A robot in MuJoCo with a push in each rollout.

    Args:
        robot: it.
        push: when, and how strong.
    """

    turns = True

    def __init__(self, robot: MujocoRobot, push: Push) -> None:
        self.control_period = robot.control_period
        self._robot, self._period = robot, 0
        self._begin = round(push.time / robot.control_period)
        self._end = self._begin + max(round(DURATION / robot.control_period), 1)
        self._force = push.impulse / ((self._end - self._begin) * robot.control_period)

    def reset(self, trial: int) -> Observation:
        """Begin the rollout."""
        self._period = 0
        return self._robot.reset(trial)

    def step(self, command: float) -> Observation:
        """Drive one control period, pushed or not."""
        self._robot.push = self._force if self._begin <= self._period < self._end else 0.0
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
