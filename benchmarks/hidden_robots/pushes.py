"""A push of 0.1 s with 1 N·s for each kg of the body: by it, robots of twbal and the reference are compared."""

from collections.abc import Sequence
from math import ceil, hypot
from typing import NamedTuple

from twbal.core.evaluation import SuccessCriterion
from twbal.core.plant import Observation, Plant, Pose
from twbal.core.robot_parameters import RobotParameters
from twbal.virtual_robot.mujoco_robot import MujocoRobot

PUSHES = 10
FIRST_PUSH = 1000
"""Number of the first trial; those before were driven to learn or to decide."""
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


class Pushed(Plant):
    """A robot that is pushed once in each rollout.

    Args:
        robot: it.
        sheet: its data sheet, by whose body mass the push is.
    """

    def __init__(self, robot: MujocoRobot, sheet: RobotParameters) -> None:
        self.control_period = robot.control_period
        self._robot, self._period = robot, 0
        self._begin = ceil(_PUSH_TIME / robot.control_period - 1e-9)
        self._end = self._begin + max(round(_PUSH_DURATION / robot.control_period), 1)
        self._force = _IMPULSE * sheet.body_mass / ((self._end - self._begin) * robot.control_period)
        self._sign = 1.0

    @property
    def steps(self) -> int:
        """Control periods of a rollout: before and after the push."""
        return self._begin + ceil((_PUSH_DURATION + _TIME_AFTER) / self.control_period)

    def verdict(self, tilts: Sequence[float], poses: Sequence[Pose], rule: SuccessCriterion) -> PushVerdict:
        """What a rollout came to, by its tilts [rad] and true poses; both begin at the start."""
        survived = len(tilts) == self.steps + 1 and max(map(abs, tilts)) <= rule.tilt_limit
        late = ceil((_PUSH_TIME + _PUSH_DURATION + _BACK) / self.control_period - 1e-9)
        limit = float("inf") if rule.place_limit is None else rule.place_limit
        return PushVerdict(survived, survived and max(hypot(pose.x, pose.y) for pose in poses[late:]) <= limit)

    def reset(self, trial: int) -> Observation:
        """Begin the rollout; every other trial is pushed backward."""
        self._period, self._sign = 0, -1.0 if trial % 2 else 1.0
        return self._robot.reset(trial)

    def step(self, command: float) -> Observation:
        """Drive one control period, pushed or not."""
        is_pushed = self._begin <= self._period < self._end
        self._robot.push = self._sign * self._force if is_pushed else 0.0
        self._period += 1
        return self._robot.step(command)

    def pose(self) -> Pose:
        """The true one."""
        return self._robot.pose()

    def stop(self) -> None:
        """See the robot's."""
        self._robot.stop()

    def close(self) -> None:
        """See the robot's."""
        self._robot.close()
