"""Motors that take time to build up their torque."""

from dataclasses import dataclass
from math import expm1

import numpy as np

from twbal.core.quantities import Quantity
from twbal.core.robot_model import TorqueFilter
from twbal.effects.effect import ActuatorEffect, Place
from twbal.effects.parameter import Scale, adds_to, parameter


@dataclass(frozen=True)
class MotorLag(ActuatorEffect):
    """Torque τ follows the command through a first-order lag, T dτ/dt = u - τ, from τ = 0.

    It acts in the motors, after everything else between command and joint; each physics step applies its mean torque,
    so that the lag is the same whatever the step.
    """

    time_constant: float = parameter(
        "T, after which 63 % of a step of torque has come",
        "s",
        (0.0, 0.1),
        start=0.01,
        value=0.02,
        scale=Scale.PERIOD,
        changes=adds_to(Quantity.MOTOR_LAG),
    )
    place = Place.MOTOR
    reference = (
        "G. F. Franklin, J. D. Powell, A. Emami-Naeini: Feedback Control of Dynamic Systems, 7th ed., Pearson, 2015."
    )
    nearly_same_as = ("actuation_delay",)
    separate_by = "Give steps of the command: a lag answers at once and slowly, a delay late and at once."

    def start(self, physics_step: float, rng: np.random.Generator) -> TorqueFilter:
        """Hand out a motor at rest."""
        share = -expm1(-physics_step / self.time_constant) if self.time_constant > 0 else 1.0
        fade = share * self.time_constant / physics_step  # mean of exp(-t / T) over a step
        torque = 0.0

        def lagged(u: float) -> float:
            nonlocal torque
            mean = u + fade * (torque - u)
            torque += share * (u - torque)
            return mean

        return lagged
