"""Input that is written down beforehand, and a robot that is always where it was."""

import numpy as np

from twbal.core.plant import Observation, Plant, WheelDifference
from twbal.policies.policy import Policy
from twbal.steering.source import Source

PERIOD = 0.02


class Script(Source):
    """Each key at the first reading from its time [s] on; lost from some time on."""

    name = "script"

    def __init__(self, *keys, lost_at=np.inf):
        self._left, self._lost_at = list(keys), lost_at

    def read(self, time):
        due = [key for at, key in self._left if at <= time]
        self._left = self._left[len(due) :]
        self.lost = time >= self._lost_at
        return due


class Still(Plant):
    """Stands where it was put, whatever it is told."""

    control_period = PERIOD

    def __init__(self):
        self.differences, self._count = [], 0

    def reset(self, trial):
        return self._seen()

    def step(self, command):
        self._count += 1
        return self._seen()

    def steer(self, difference):
        self.differences.append(difference)

    def wheel_difference(self):
        return WheelDifference(0.0, 0.0)

    def stop(self):
        pass

    def close(self):
        pass

    def _seen(self):
        return Observation(self._count * PERIOD, *(0.0,) * 6)


class Eager(Policy):
    """Commands what the speed is off by."""

    channels = ("tilt", "speed", "position")

    def controller(self, rng):
        return lambda state: float(state[1])
