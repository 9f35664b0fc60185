"""A robot whose tilt comes from a complementary filter, as that of many small robots does."""

from twbal.core.plant import Plant
from twbal.core.robot_parameters import GRAVITY


class FilteredTilt(Plant):
    """Shows the tilt of a complementary filter of gyro and accelerometer, begun at the truth.

    R. Mahony, T. Hamel, J.-M. Pflimlin: Nonlinear complementary filters on the special orthogonal group, IEEE
    Transactions on Automatic Control 53 (5), 2008, 1203-1218; here about one axis. The accelerometer takes speeding up
    for leaning back: it shows θ - v̇ / g. The gyro is read so often that its noise does not count.

    Args:
        plant: a planar robot; it knows its true tilt. The noise of its tilt is added to the filter's.
        filter_rate: 1 / time constant [1/s].
    """

    def __init__(self, plant, filter_rate):
        self.control_period = plant.control_period
        self._plant, self._rate = plant, filter_rate

    def reset(self, trial):
        """The plant's, whose filter has had the time to settle."""
        seen = self._plant.reset(trial)
        self._angle = self._true = self._plant.pose().tilt
        return seen

    def step(self, command):
        """The plant's, with the filter's tilt."""
        seen = self._plant.step(command)
        true, dt = self._plant.pose().tilt, self.control_period
        passed = dt * self._rate
        gyro, self._true = (true - self._true) / dt, true
        accelerometer = true - seen.acceleration / GRAVITY
        self._angle = (1.0 - passed) * (self._angle + gyro * dt) + passed * accelerometer
        return seen._replace(tilt=self._angle + seen.tilt - true)

    def pose(self):
        """The true pose."""
        return self._plant.pose()

    def stop(self):
        """Nothing turns."""

    def close(self):
        """Nothing is held."""
