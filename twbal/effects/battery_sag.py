"""A battery that runs down."""

from dataclasses import dataclass

import numpy as np

from twbal.core.robot_model import TorqueFilter
from twbal.effects.effect import ActuatorEffect, Place, parameter


@dataclass(frozen=True)
class BatterySag(ActuatorEffect):
    """The torque falls to 1 / (1 + rate·t) of itself, t being the time since the rollout began.

    It acts on the motors. In a short recording it is hardly told from a torque gain.

    Attributes:
        rate: [1/s].
    """

    rate: float = parameter("1/s", 0.0, 0.3, 0.02)
    place = Place.GEAR
    cannot_be_told_from = ("torque_gain", "body_mass")
    separate_by = "Record for longer."

    def __post_init__(self) -> None:
        self._require("rate", 0)

    def start(self, physics_step: float, rng: np.random.Generator) -> TorqueFilter:
        """Hand out a full battery."""
        steps = -1

        def sagging(u: float) -> float:
            nonlocal steps
            steps += 1
            return u / (1.0 + self.rate * steps * physics_step)

        return sagging
