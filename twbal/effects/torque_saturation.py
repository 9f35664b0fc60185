"""Motors that give less than the data sheet says."""

from dataclasses import dataclass

import numpy as np

from twbal.core.robot_model import TorqueFilter
from twbal.effects.effect import ActuatorEffect, Place, parameter


@dataclass(frozen=True)
class TorqueSaturation(ActuatorEffect):
    """The driver cuts the torque at `limit`, below the limit of the data sheet.

    It acts after the dead zone and before the gain. Only commands beyond it tell of it.

    Attributes:
        limit: on the summed torque [N·m].
    """

    limit: float = parameter("N·m", 1.0, 20.0, 8.0, none=1e9, scale="torque")
    place = Place.DRIVER
    remembers = False
    cannot_be_told_from = ("torque_gain",)
    separate_by = "Command large torques for a short while."

    def __post_init__(self) -> None:
        self._require("limit", 0)

    def start(self, physics_step: float, rng: np.random.Generator) -> TorqueFilter:
        """Hand out the limit; it remembers nothing."""
        limit = self.limit
        return lambda u: min(max(u, -limit), limit)
