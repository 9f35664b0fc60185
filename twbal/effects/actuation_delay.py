"""Commands that act late."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from twbal.core.quantities import Quantity
from twbal.core.robot_model import TorqueFilter
from twbal.effects.effect import ActuatorEffect, Place
from twbal.effects.parameter import Scale, adds_to, parameter


@dataclass(frozen=True)
class ActuationDelay(ActuatorEffect):
    """Commands act `delay` late; the motors are idle until the first one arrives.

    It acts on the command, before the driver. Where the delay ends within a physics step, the mean torque of that step
    is applied, so that the motion depends smoothly on the delay. The same delay of all sensors has the same effect.
    """

    delay: float = parameter(
        "by which commands act late; any fraction of a control period",
        "s",
        (0.0, 0.06),
        start=0.01,
        value=0.02,
        scale=Scale.PERIOD,
        below=10.0,
        changes=adds_to(Quantity.COMMAND_DELAY),
    )
    place = Place.COMMAND
    reference = "K. J. Åström, B. Wittenmark: Computer-Controlled Systems, 3rd ed., Prentice Hall, 1997."
    nearly_same_as = ("motor_lag", "imu_delay")
    separate_by = "Give steps of the command: a lag answers at once and slowly, a delay late and at once."

    def start(self, physics_step: float, rng: np.random.Generator) -> TorqueFilter:
        """Hand out an empty line of commands under way."""
        steps = round(self.delay / physics_step, 9)  # 0.06 s is 60 steps of 1 ms, not 59.99...
        whole, fraction = int(steps), steps % 1
        past = deque([0.0] * (whole + 2), maxlen=whole + 2)

        def delayed(u: float) -> float:
            past.append(u)
            return (1 - fraction) * past[1] + fraction * past[0]

        return delayed
