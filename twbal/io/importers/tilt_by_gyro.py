"""The tilt of a log that has none: a complementary filter of gyro and accelerometer, or the sum of the gyro alone."""

from collections.abc import Mapping

import numpy as np

from twbal.core.gaussian import Array
from twbal.io.importers.checks.rates import integral
from twbal.io.importers.mapping import ACCELEROMETER

FILTER_TIME = 1.0
"""Time constant of the complementary filter, in the middle of what robots have (0.5 to 2 s) [s]."""


def tilt_by_gyro(signals: Mapping[str, Array], period: float, first: int = 0) -> Array:
    """Tilt of a body by its sensors (n,) [rad].

    With an accelerometer θ' = gyro + (arctan2(-forward, up) - θ) / `FILTER_TIME`, the filter whose errors the effect
    `tilt_filter` makes. The gyro goes straight from sample to sample. What the accelerometer shows at the end of a
    period stands for all of it, as it goes by the command that was held there. Without an accelerometer the gyro is
    summed, and the straight line of least squares through the samples from `first` on is taken off, which is what its
    bias adds: the mean of such a tilt is 0 over these samples, and tells nothing. Of fewer than two it is 0 throughout.

    Args:
        signals: with `tilt_rate`, and either both of `ACCELEROMETER` or none, (n,) each.
        period: between samples [s].
        first: sample from which on the recording counts.
    """
    turned = integral(signals["tilt_rate"], period)
    if ACCELEROMETER[0] not in signals:
        number = np.arange(len(turned))
        if len(turned) - first < 2:
            return np.zeros(len(turned))
        return turned - np.polyval(np.polyfit(number[first:], turned[first:], 1), number)
    from scipy.signal import lfilter  # loads slowly, and few logs have no tilt

    forward, up = (signals[name] for name in ACCELEROMETER)
    leaning = np.unwrap(np.arctan2(-forward, up))
    kept = float(np.exp(-period / FILTER_TIME))
    few = max(1, min(round(FILTER_TIME / period), len(turned)))
    begin = float(np.mean(leaning[:few] - turned[:few]))
    share = (1.0 - kept) * FILTER_TIME / period  # of what the gyro turns in a period that is left at its end
    pushed = share * np.diff(turned) + (1.0 - kept) * leaning[1:]
    return np.concatenate([[begin], lfilter([1.0], [1.0, -kept], pushed, zi=[kept * begin])[0]])
