"""A push of 0.1 s with 1 N·s for each kg of the body: by it, robots of twbal and the reference are compared."""

from collections.abc import Sequence
from math import ceil, hypot
from typing import NamedTuple

from twbal.core.evaluation import SuccessCriterion
from twbal.core.plant import Pose
from twbal.core.robot_parameters import RobotParameters
from twbal.virtual_robot.mujoco_robot import MujocoRobot
from twbal.virtual_robot.pushed_robot import PushedRobot

PUSHES = 10
FIRST_PUSH = 1000
"""Number of the first trial; those before were driven to learn or to decide."""
RESULTS_OF_PUSHES = {"pushes": False, "yielding_pushes": True}
"""What the results of pushes are called, and whether the robot yields to them."""
_PUSH_TIME, _PUSH_DURATION, _TIME_AFTER = 5.0, 0.1, 10.0  # [s]
_BACK = 5.0  # after a push, in which it must be back in place [s]
_IMPULSE = 10.0 / 10.0  # over the mass of the data sheet's body [N·s/kg]


class PushVerdict(NamedTuple):
    """What became of a push.

    Attributes:
        survived: the tilt never passed its limit.
        back: and the robot was back in place in time, and stayed there.
    """

    survived: bool
    back: bool


class Pushed(PushedRobot):
    """A robot that is pushed once in each rollout.

    Args:
        robot: it.
        sheet: its data sheet, by whose body mass the push is.
    """

    def __init__(self, robot: MujocoRobot, sheet: RobotParameters) -> None:
        super().__init__(robot, _PUSH_TIME, _PUSH_DURATION, _IMPULSE * sheet.body_mass)

    @property
    def steps(self) -> int:
        """Control periods of a rollout: before and after the push."""
        return self.begin + ceil((_PUSH_DURATION + _TIME_AFTER) / self.control_period)

    def verdict(self, tilts: Sequence[float], poses: Sequence[Pose], rule: SuccessCriterion) -> PushVerdict:
        """What a rollout came to, by its tilts [rad] and true poses; both begin at the start."""
        survived = len(tilts) == self.steps + 1 and max(map(abs, tilts)) <= rule.tilt_limit
        late = ceil((_PUSH_TIME + _PUSH_DURATION + _BACK) / self.control_period - 1e-9)
        limit = float("inf") if rule.place_limit is None else rule.place_limit
        return PushVerdict(survived, survived and max(hypot(pose.x, pose.y) for pose in poses[late:]) <= limit)
