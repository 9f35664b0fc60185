"""A gyro whose bias walks."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from twbal.core.plant import Observation
from twbal.core.robot_model import Sensor, SensorFilter
from twbal.core.robot_parameters import RobotParameters
from twbal.effects.effect import Effect, Place, SensorEffect
from twbal.effects.parameter import parameter
from twbal.effects.tilt_filter import Forgetting, TiltFilter


@dataclass(frozen=True)
class GyroBiasWalk(SensorEffect):
    """The gyro's bias does a random walk from 0: over t seconds its standard deviation grows to `density`·√t.

    It acts on the measured tilt rate, and on the tilt that a `tilt_filter` makes of it. It is a change of the noise, so
    that no prediction of the motion shows it, and the planar model does without it. A diagnosis tells it from the noise
    that it fits, and names no effect for it.
    """

    density: float = parameter(
        "by which the bias walks in a second", "rad/s/√s", (0.0, 0.1), start=0.001, value=0.001, below=100.0
    )
    place = Place.OFFSET
    diagnosed_separately = True
    reference = (
        "N. El-Sheimy, H. Hou, X. Niu: Analysis and modeling of inertial sensors using Allan variance, "
        "IEEE Transactions on Instrumentation and Measurement 57 (1), 2008, 140-149."
    )
    is_linear = False
    separate_by = "Let the robot lie still for minutes, and look at the Allan variance of the gyro."

    def start(self, control_period: float, rng: np.random.Generator) -> SensorFilter:
        """Hand out a gyro without a bias, from which no tilt is made."""
        return _Walk(self, 0.0).start(control_period, rng)

    def on(self, robot: RobotParameters, effects: Sequence[Effect]) -> Sensor:
        """The gyro of a robot whose tilt may come from a filter of it."""
        return _Walk(self, next((effect.rate for effect in effects if isinstance(effect, TiltFilter)), 0.0))


class _Walk(NamedTuple):
    """A bias that walks, and the rate of the filter that makes a tilt of it [1/s]; 0: there is none."""

    effect: GyroBiasWalk
    filter_rate: float

    def start(self, control_period: float, rng: np.random.Generator) -> SensorFilter:
        """Hand out a gyro without a bias, and a filter that shows none."""
        step, bias, off = self.effect.density * control_period**0.5, 0.0, 0.0
        forgetting = Forgetting.of(self.filter_rate, control_period)

        def walking(truth: Observation) -> Observation:
            nonlocal bias, off
            shown = truth._replace(tilt=truth.tilt + off, tilt_rate=truth.tilt_rate + bias)
            before = bias
            bias += step * float(rng.standard_normal())
            if self.filter_rate > 0.0:
                off = forgetting.after(off, 0.5 * control_period * (before + bias))
            return shown

        return walking
