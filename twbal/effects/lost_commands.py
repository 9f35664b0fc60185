"""Commands that do not reach the robot."""

from dataclasses import dataclass

import numpy as np

from twbal.core.robot_model import TorqueFilter
from twbal.effects.effect import ActuatorEffect, Place
from twbal.effects.parameter import parameter


@dataclass(frozen=True)
class LostCommands(ActuatorEffect):
    """A `share` of the commands, drawn at random, is lost on the way to the robot, which holds the one before.

    Each command is lost or not by itself. A command that equals the one before does the same whether it is lost or
    not. The planar model, which draws nothing, does without it. A diagnosis tells it from single control periods.
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
    told_apart = True
    reference = (
        "J. Nilsson: Real-Time Control Systems with Delays, PhD thesis, Department of Automatic Control, Lund "
        "Institute of Technology, 1998."
    )
    separate_by = "Number the commands, and let the robot send back the number of the one that acts."

    def start(self, physics_step: float, rng: np.random.Generator) -> TorqueFilter:
        """Hand out a link whose motors are idle until the first command comes through."""
        sent = acting = 0.0

        def through(u: float) -> float:
            nonlocal sent, acting
            if u != sent:
                sent = u
                if rng.uniform() >= self.share:
                    acting = u
            return acting

        return through
