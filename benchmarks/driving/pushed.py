"""A robot that is pushed once on its way."""

from benchmarks.driving.tasks import Push
from twbal.core.plant import Observation
from twbal.virtual_robot.mujoco_robot import MujocoRobot
from twbal.virtual_robot.pushed_robot import PushedRobot

DURATION = 0.1  # of a push [s]


class PushedOnce(PushedRobot):
    """A robot in MuJoCo with a push in each rollout, in the direction of its impulse.

    Args:
        robot: it.
        push: when, to the nearest control period, and how strong.
    """

    def __init__(self, robot: MujocoRobot, push: Push) -> None:
        nearest = round(push.time / robot.control_period) * robot.control_period
        super().__init__(robot, nearest, DURATION, push.impulse)

    def reset(self, trial: int) -> Observation:
        """Begin the rollout."""
        seen = super().reset(trial)
        self._sign = 1.0  # in all trials
        return seen
