"""A battery that runs down."""

from dataclasses import dataclass

import numpy as np

from twbal.core.robot_model import TorqueFilter
from twbal.effects.effect import ActuatorEffect, Place, TorqueTerm
from twbal.effects.parameter import parameter


@dataclass(frozen=True)
class BatterySag(ActuatorEffect, TorqueTerm):
    """The torque falls to 1 / (1 + rate·t) of itself, t being the time since the rollout began.

    It acts on the motors. A short recording shows little more than its mean, which is a torque gain.
    """

    rate: float = parameter(
        "share of the torque that is lost in a second, at first", "1/s", (0.0, 0.3), start=0.02, value=0.05
    )
    place = Place.GEAR
    reference = (
        "C. M. Shepherd: Design of primary and secondary cells II. An equation describing battery discharge, "
        "Journal of the Electrochemical Society 112 (7), 1965, 657-664."
    )
    nearly_same_as = ("torque_gain", "body_mass")
    separate_by = "Record for longer."
    is_last = True

    def start(self, physics_step: float, rng: np.random.Generator) -> TorqueFilter:
        """Hand out a full battery."""
        steps = -1

        def sagging(u: float) -> float:
            nonlocal steps
            steps += 1
            return u / (1.0 + self.rate * steps * physics_step)

        return sagging

    def drive(self, torque: float, time: float) -> float:
        """What the battery still gives."""
        return torque / (1.0 + self.rate * time)
