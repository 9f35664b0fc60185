"""A loop that is not even: what was commanded and read at which instant."""

from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.core.time_base import Even
from twbal.planar.planar_state import PlanarState

_TILT, _TILT_RATE = 0, 1  # columns, in the order of `recording.MEASURED`
_ANGLES, _RATES = (
    [PlanarState._fields.index(name) for name in names]
    for names in (("tilt", "wheel", "rotor", "sway"), ("tilt_rate", "wheel_speed", "rotor_speed", "sway_rate"))
)  # columns of the predictor's states


class UnevenLoop(NamedTuple):
    """What was commanded and read at the instants of a loop that is not even.

    Attributes:
        instants: (T + 1,) of samples and commands by their stamps, increasing [s].
        lateness: (T + 1,) of these instants beside those of an even loop, in control periods.
        commands: (T,) [N·m]; commands[n] acted from instant n on, until the next one.
        readings: (T + 1, 4) in the order of `recording.MEASURED`, as they were read.
        summed: (T + 1,) what each of its periods adds to a tilt that sums up the gyro, beyond what one of an even loop
            would [rad]; see `uneven_sum`.
    """

    instants: Array
    lateness: Array
    commands: Array
    readings: Array
    summed: Array

    def read(self, filter_rate: float, period: float) -> Array:
        """The readings (T + 1, 4) with the tilt that a filter would have shown, had it summed up in even periods.

        Args:
            filter_rate: of the complementary filter that the tilt comes from; 0: it comes from none [1/s].
            period: control period [s].
        """
        if filter_rate == 0.0:
            return self.readings
        from scipy.signal import lfilter  # loads slowly, and few loops are uneven

        readings, kept = self.readings.copy(), np.exp(-filter_rate * period)
        readings[:, _TILT] -= lfilter([1.0], [1.0, -kept], self.summed)
        return readings

    def even_states(self, states: Array, period: float) -> Array:
        """The predictor's states (T + 1, 19) at the instants of an even loop, from those at its own instants.

        Within a period of the loop all change evenly, and an angle as its rate does.

        Args:
            states: (T + 1, 19) as of `PredictorOutput`.
            period: control period [s].
        """
        even = self.instants - self.lateness * period
        found = np.column_stack([np.interp(even, self.instants, column) for column in states.T])
        begin = np.clip(np.searchsorted(self.instants, even, side="right") - 1, 0, len(even) - 2)
        since, until = even - self.instants[begin], self.instants[begin + 1] - even
        slopes = (states[begin + 1][:, _RATES] - states[begin][:, _RATES]) / (since + until)[:, None]
        found[:, _ANGLES] -= 0.5 * np.maximum(since * until, 0.0)[:, None] * slopes
        return found

    def commands_over(self, period: float, parts: int) -> Array:
        """Means (T, parts) of the commands over equal parts of each period of an even loop [N·m].

        Args:
            period: control period [s].
            parts: of each, such as its physics steps.
        """
        instants = np.concatenate([[self.instants[0] - period], self.instants, [self.instants[-1] + period]])
        commands = np.concatenate([self.commands[:1], self.commands, self.commands[-1:]])
        impulse = np.concatenate([[0.0], np.cumsum(commands * np.diff(instants))])
        even = self.instants - self.lateness * period
        edges = np.interp(np.arange(len(self.commands) * parts + 1) / parts, np.arange(len(even)), even)
        means = np.diff(np.interp(edges, instants, impulse)) / np.diff(edges)
        return np.asarray(means.reshape(-1, parts))

    def part(self, begin: int, end: int) -> "UnevenLoop":
        """What lies between two instants, which both belong to it."""
        whole = slice(begin, end + 1)
        instants = self.instants[whole] - self.instants[begin]
        lateness, commands = self.lateness[whole], self.commands[begin:end]
        return UnevenLoop(instants, lateness, commands, self.readings[whole], self.summed[whole])


def loop_of(even: Even, times: Array, measured: Array, period: float) -> UnevenLoop | None:
    """The loop by which samples (T + 1, 4) were taken at `times` that were put on an even time base; None: it was even.

    A lost row lies between its neighbours.
    """
    if not even.late.any():
        return None
    numbers = np.flatnonzero(even.measured)
    instants = np.interp(np.arange(len(even.values)), numbers, times - times[0])
    readings = even.values[:, :-1].copy()
    readings[numbers] = measured
    summed = uneven_sum(even, readings[:, _TILT_RATE])
    return UnevenLoop(instants, even.late / period, even.sent, readings, summed)


def uneven_sum(even: Even, rates: Array) -> Array:
    """What each period of an uneven loop adds to a tilt that sums up the gyro, beyond an even one, (K + 1,) [rad].

    A complementary filter adds up the gyro's reading times the time L since the one before. That is what the tilt gains
    in that time, and half of L times the change of θ', where an even loop has the period in place of L. The filter
    forgets the difference at its rate. At instants beside a lost row nothing is known of it.

    Args:
        even: the samples on an even time base.
        rates: (K + 1,) of the tilt, as they were read [rad/s].
    """
    added = 0.5 * np.diff(even.late) * np.diff(rates)
    return np.concatenate([[0.0], np.where(even.measured[1:] & even.measured[:-1], added, 0.0)])
