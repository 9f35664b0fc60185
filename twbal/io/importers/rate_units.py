"""The unit of a rate that no name tells: that in which it sums up to the changes of its angle."""

from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.io.importers.mapping import UNITS

_WINDOW = 0.25  # s; over which a rate is summed, so that the noise of the angle is small beside its change
_ALIKE = 0.8  # correlation of sums and changes, from which on they are of one motion


class Sums(NamedTuple):
    """A rate summed over time beside the changes of an angle.

    Attributes:
        correlation: of both; 0 where one of them stands still.
        size: of the rate's unit, as they tell it [rad/s].
    """

    correlation: float
    size: float

    @property
    def are_alike(self) -> bool:
        """Whether both are of one motion, with either sign."""
        return abs(self.correlation) >= _ALIKE


def rate_unit(sums: Sums, off: float) -> str | None:
    """The unit of a rate; None where its sums are not alike to the changes of its angle, or fit no unit.

    Args:
        sums: of the rate.
        off: times by which their sizes may differ from those of a unit.
    """
    if not sums.are_alike:
        return None
    fitting = {unit: max(sums.size / of_it, of_it / sums.size) for unit, of_it in UNITS["rad/s"].items()}
    best = min(fitting, key=lambda unit: fitting[unit])
    return best if fitting[best] < off else None


def sums_of(time: Array, angle: Array, rate: Array) -> Sums:
    """How a rate sums up to the changes of an angle.

    Args:
        time: of each row [s], growing.
        angle: [rad], with either sign.
        rate: in its own unit.
    """
    there = np.isfinite(time) & np.isfinite(angle) & np.isfinite(rate)
    time, angle, rate = time[there], angle[there], rate[there]
    if len(time) < 2 or time[-1] - time[0] < 8.0 * _WINDOW:
        return Sums(0.0, 1.0)
    summed = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))])
    ends = np.searchsorted(time, np.arange(time[0], time[-1], _WINDOW))
    sums, changes = np.diff(summed[ends]), np.diff(angle[ends])
    sums, changes = sums - sums.mean(), changes - changes.mean()  # without the bias of a gyro
    sizes = float(np.sqrt((sums @ sums) * (changes @ changes)))
    if sizes == 0.0:
        return Sums(0.0, 1.0)
    return Sums(float(sums @ changes) / sizes, abs(float(sums @ changes)) / float(sums @ sums))
