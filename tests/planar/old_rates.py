"""A robot whose wheel rates are old, as differences of encoder angles are."""

from twbal.core.plant import Plant


class OldRates(Plant):
    """Shows wheel rates between those at the beginning and at the end of the last control period.

    Args:
        plant: a robot.
        age: how old they are, as a share of the control period.
    """

    def __init__(self, plant, age):
        self.control_period = plant.control_period
        self._plant, self._age = plant, age

    def reset(self, trial):
        """The plant's, whose wheels turn as they did before."""
        seen = self._plant.reset(trial)
        self._rate = seen.wheel_rate
        return seen

    def step(self, command):
        """The plant's, with an older wheel rate."""
        seen = self._plant.step(command)
        before, self._rate = self._rate, seen.wheel_rate
        return seen._replace(wheel_rate=(1.0 - self._age) * seen.wheel_rate + self._age * before)

    def pose(self):
        """The true pose."""
        return self._plant.pose()

    def stop(self):
        """Nothing turns."""

    def close(self):
        """Nothing is held."""
