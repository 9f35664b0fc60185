"""Commands that act late."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from twbal.core.robot_model import TorqueFilter
from twbal.effects.effect import ActuatorEffect, Place, parameter


@dataclass(frozen=True)
class ActuationDelay(ActuatorEffect):
    """Commands act `delay` late; the motors are idle until the first one arrives.

    It acts on the command, before the driver. Of a physics step that the delay cuts in two, the mean torque is applied,
    so the robot changes smoothly with the delay. It cannot be told from the same delay of all sensors, and hardly from
    a motor lag.

    Attributes:
        delay: [s]; any fraction of a control period.
    """

    delay: float = parameter("s", 0.0, 0.06, 0.01, scale="period")
    place = Place.COMMAND
    cannot_be_told_from = ("motor_lag", "imu_delay")
    separate_by = "Give steps of the command: a lag answers at once and slowly, a delay late and at once."

    def __post_init__(self) -> None:
        self._require("delay", 0, 10)

    def start(self, physics_step: float, rng: np.random.Generator) -> TorqueFilter:
        """Hand out an empty line of commands under way."""
        steps = round(self.delay / physics_step, 9)  # 0.06 s is 60 steps of 1 ms, not 59.99...
        whole, fraction = int(steps), steps % 1
        past = deque([0.0] * (whole + 2), maxlen=whole + 2)

        def delayed(u: float) -> float:
            past.append(u)
            return (1 - fraction) * past[1] + fraction * past[0]

        return delayed
