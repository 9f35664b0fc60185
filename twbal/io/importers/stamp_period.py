"""The time between the samples of a log, as its stamps tell it, and how well they do."""

from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array

_EXACT = 1e-6  # share of a period by which steps vary that were worked out and not measured
_CLOCK = 2e-4  # share to which a period that was measured is known at best: so far off are clocks
_LOOSEST = 5e-3  # and at worst
_SINGLE = 0.52  # typical steps by which one in which no row was lost differs: also one of 31 ms where most have 16
_DIGITS = 12  # of a period or a rate that are tried


class Period(NamedTuple):
    """The time between samples.

    Attributes:
        mean: [s].
        doubt: by which the mean may be off, as stamps jitter or are rounded [s].
    """

    mean: float
    doubt: float

    def of(self, samples: int, wanted: float | None = None) -> float:
        """Time of so many samples [s]: the plainest period or rate within the doubt, so that 70 Hz stay 1/70 s.

        Args:
            samples: in a row.
            wanted: what it is to be, which is taken where that is about as much [s].
        """
        mean, doubt = samples * self.mean, samples * self.doubt
        if wanted is not None and abs(wanted - mean) <= _LOOSEST * mean:
            return wanted
        for digits in range(1, _DIGITS + 1):
            for plain in (float(f"{mean:.{digits}g}"), 1.0 / float(f"{1.0 / mean:.{digits}g}")):
                if abs(plain - mean) <= doubt:
                    return plain
        return mean


def period_of(steps: Array, typical: float) -> Period:
    """Mean step where no sample is missing, and twice its standard error.

    Args:
        steps: between stamps (n,), some of them about a typical one [s].
        typical: step [s].
    """
    single = steps[np.abs(steps / typical - 1.0) <= _SINGLE]
    if not len(single):
        return measured_period(typical, typical)
    mean, spread = float(single.mean()), float(single.std())
    if spread < _EXACT * mean:
        return Period(mean, 1e-3 * _EXACT * mean)
    return measured_period(mean, 2.0 * spread / float(np.sqrt(len(single))))


def measured_period(mean: float, doubt: float) -> Period:
    """A period that stamps tell to within a doubt, which is no less than clocks are off, and half a percent at most.

    Args:
        mean: step [s].
        doubt: twice its standard error [s].
    """
    return Period(mean, float(np.clip(doubt, _CLOCK * mean, _LOOSEST * mean)))


def even_rate(steps: Array, far: float) -> float:
    """The plainest rate of rows that are evenly apart, whatever their stamps [Hz].

    Args:
        steps: between stamps (n,) [s].
        far: step from which on it is a gap [s].
    """
    mean = float(steps[np.abs(steps) < far].mean())
    return 1.0 / Period(mean, _LOOSEST * mean).of(1)
