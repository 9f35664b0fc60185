"""A robot whose wheel rates are differences of angles, as encoders give them."""

from twbal.core.plant import Plant


class DifferencedRates(Plant):
    """Shows the mean wheel rate of the last control period in place of that at its end.

    Args:
        plant: a robot without noise on its wheel angles.
    """

    def __init__(self, plant):
        self.control_period = plant.control_period
        self._plant = plant

    def reset(self, trial):
        """The plant's, whose wheels turn as they did before."""
        seen = self._plant.reset(trial)
        self._angle = seen.wheel_angle
        return seen

    def step(self, command):
        """The plant's, with a difference of two angles."""
        seen = self._plant.step(command)
        rate, self._angle = (seen.wheel_angle - self._angle) / self.control_period, seen.wheel_angle
        return seen._replace(wheel_rate=rate)

    def pose(self):
        """The true pose."""
        return self._plant.pose()

    def stop(self):
        """Nothing turns."""

    def close(self):
        """Nothing is held."""
