"""Commands that do not reach the robot."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from twbal.core.engine import substeps
from twbal.core.robot_model import Actuator, TorqueFilter
from twbal.core.robot_parameters import RobotParameters
from twbal.effects.effect import ActuatorEffect, Place
from twbal.effects.parameter import parameter


@dataclass(frozen=True)
class LostCommands(ActuatorEffect):
    """A `share` of the commands, drawn at random, is lost on the way to the robot, which holds the one before.

    There is one command in each control period, and it is lost or not whatever became of the others. The planar model,
    which draws nothing, does without it. A diagnosis tells it from single control periods.
    """

    share: float = parameter(
        "of the commands that is lost, each for itself",
        "",
        (0.0, 0.5),
        start=0.05,
        value=0.05,
        below=1.0,
    )
    place = Place.LINK
    diagnosed_separately = True
    reference = (
        "J. Nilsson: Real-Time Control Systems with Delays, PhD thesis, Department of Automatic Control, Lund "
        "Institute of Technology, 1998."
    )
    separate_by = "Number the commands, and let the robot send back the number of the one that acts."

    def on(self, robot: RobotParameters) -> Actuator:
        """The link to a robot, which gets a command in each of its control periods."""
        return _Link(self.share, robot.control_period)

    def start(self, physics_step: float, rng: np.random.Generator) -> TorqueFilter:
        """Hand out a link that gets a command in each physics step."""
        return _Link(self.share, physics_step).start(physics_step, rng)


@dataclass(frozen=True)
class _Link:
    """A link to a robot with a control period [s]."""

    share: float
    period: float
    remembers: ClassVar[bool] = True

    def start(self, physics_step: float, rng: np.random.Generator) -> TorqueFilter:
        """Hand out a link whose motors are idle until the first command comes through."""
        steps = substeps(self.period, physics_step)
        number, acting = 0, 0.0

        def through(u: float) -> float:
            nonlocal number, acting
            if number % steps == 0 and rng.uniform() >= self.share:
                acting = u
            number += 1
            return acting

        return through
