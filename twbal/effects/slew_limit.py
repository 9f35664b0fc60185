"""Drivers that change their torque no faster than at some rate."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from twbal.core.quantities import Quantity
from twbal.core.robot_model import UNBOUNDED, TorqueFilter
from twbal.effects.effect import ActuatorEffect, Place
from twbal.effects.parameter import Scale, parameter, replaces


class Ramp(NamedTuple):
    """What becomes of a torque within one physics step.

    Attributes:
        end: to which it has come [N·m].
        mean: over the step [N·m].
    """

    end: float
    mean: float


def ramp(torque: float, demanded: float, most: float) -> Ramp:
    """The way of a torque [N·m] to the one that is demanded, by at most `most` in the step; simple enough for numba."""
    change = demanded - torque
    if abs(change) <= most:
        return Ramp(demanded, demanded - 0.5 * change * abs(change) / most)
    step = most if change > 0.0 else -most
    return Ramp(torque + step, torque + 0.5 * step)


@dataclass(frozen=True)
class SlewLimit(ActuatorEffect):
    """The driver changes its torque by at most `rate` in a second, from 0 on.

    Drivers limit it to spare gears and batteries (as an acceleration limit, a ramp or a soft start). It acts after the
    dead zone, the gain and the battery, and before the motors' lag; each physics step applies its mean torque. Only
    commands that change faster tell of it.
    """

    rate: float = parameter(
        "fastest change of the summed torque",
        "N·m/s",
        (0.2, 2000.0),
        start=200.0,
        value=200.0,
        neutral=UNBOUNDED,
        scale=Scale.TORQUE,
        least=1e-6,
        changes=replaces(Quantity.SLEW_RATE),
    )
    place = Place.RAMP
    reference = (
        "K. J. Åström, T. Hägglund: Advanced PID Control, ISA - The Instrumentation, Systems, and Automation Society, "
        "2006."
    )
    nearly_same_as = ("motor_lag", "actuation_delay")
    separate_by = "Give small and large steps of the command: the time that a slew limit takes grows with the step."

    def start(self, physics_step: float, rng: np.random.Generator) -> TorqueFilter:
        """Hand out a driver at rest."""
        if self.rate >= UNBOUNDED:
            return lambda u: u
        torque, most = 0.0, self.rate * physics_step

        def ramped(u: float) -> float:
            nonlocal torque
            torque, mean = ramp(torque, u, most)
            return mean

        return ramped
