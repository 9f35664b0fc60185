"""Which row an angle belongs to, by what must be the same to the last digit: the noise and the ticks of its rate.

A tilt that is filtered from a gyro takes the gyro's noise of its own row in, and that of earlier rows; one that is a
row late knows nothing of its row. A rate of an encoder that is differenced from its counts is a sum of the counts'
changes up to its row, ticks included; if the counts are a row late, that sum reaches a row ahead. Neither depends on
mechanics, on how the robot drives, or on what a filter makes of slow motion.
"""

from collections.abc import Iterator

import numpy as np

from twbal.core.block_regression import Regression, regression
from twbal.core.gaussian import Array
from twbal.core.smoothed_derivatives import noise_sd
from twbal.io.importers.checks.doubt import Curves, Doubt, DoubtKind, LogPart

_BEFORE = 6  # rows that are left out at the beginning, for lags
_RATES, _STEPS = 4, 3  # rows of the gyro and of the wheels before, from which the tilt's change is predicted
_TIMES = 4.0  # as much of the gyro's last row must be in the tilt as of its own, before its row is wrong
_AHEAD = 2  # rows ahead of a rate that are looked at
_TICKS = 0.2  # of the ticks' noise, below which a rate is made of the ticks themselves
_SHARE = 0.2  # of a row's change in a rate, from which it is in it


def tilt_row_doubts(part: LogPart) -> Iterator[Doubt]:
    """A sentence on a tilt that takes the gyro in a row late, or on a log that does not tell.

    The tilt's change is regressed on the gyro's rows, a₀ g[k] + a₁ g[k-1] + ... A tilt in its row has a₀ of at least
    a quarter of a₁: of a filter that sums the gyro a₁ is none, of the angle itself the two are the same, and a few
    times a₀ where a late command makes the robot turn in bursts.
    """
    if not part.has_tilt:
        return
    if not {"tilt", "tilt_rate"} <= set(part.signals):
        yield Doubt(
            DoubtKind.UNTOLD,
            "tilt",
            "whether the tilt is of its row: the log has no tilt_rate. Log the gyro's rate of each row",
        )
        return
    tilt, gyro = part.signals["tilt"], part.signals["tilt_rate"]
    change = np.diff(tilt, prepend=tilt[:1])
    own, late, *others = _rows(gyro, 0, _RATES)
    own, late = own * part.period, late * part.period
    columns = [late, own + _TIMES * late, *others, *_rows(tilt, 1, 1), *_wheels(part)]
    fit = regression(change[_BEFORE:], columns, part.period)
    beyond, half = float(fit.coefficients[0]), float(fit.half_widths[0])
    if beyond > half:
        sentence = (
            f"the tilt takes the gyro in a row ({1e3 * part.period:.2g} ms) late: is its column shifted, or is it a "
            "value of the loop before?"
        )
        names = "change of the tilt [rad]", "turn by the gyro's rate of the same row [rad]"
        yield Doubt(DoubtKind.ROW, "tilt", sentence, Curves(part.period, change[_BEFORE:], names[0], own, names[1]))
    elif beyond > -half:
        yield Doubt(
            DoubtKind.UNTOLD,
            "tilt",
            "whether the tilt is of its row: it hardly has more of one row of the gyro than of the next. Log more "
            "digits, or move the robot more quickly",
        )


def is_differenced(part: LogPart) -> bool:
    """Whether the wheels' rate is made of the ticks of their angle, so that it tells the angle's row."""
    return {"wheel_angle", "wheel_rate"} <= set(part.signals) and _rest_of_rate(part)[1]


def wheel_row_doubts(part: LogPart) -> Iterator[Doubt]:
    """A sentence on an angle of the wheels that comes a row after their rate, where the rate is made of its ticks."""
    if not {"wheel_angle", "wheel_rate"} <= set(part.signals):
        return
    fit, tells = _rest_of_rate(part)
    if not tells:
        return
    rate = part.signals["wheel_rate"][_BEFORE : _BEFORE + len(fit.fitted)]
    ahead, half = float(fit.coefficients[_AHEAD - 1]), float(fit.half_widths[_AHEAD - 1])
    if ahead - half > _SHARE:
        sentence = (
            f"the wheels' rate has changes of their angle in it that come a row ({1e3 * part.period:.2g} ms) after "
            "it: is the angle's column shifted?"
        )
        angle = part.signals["wheel_angle"]
        change = np.diff(angle, prepend=angle[:1])[_BEFORE : _BEFORE + len(rate)] / part.period
        names = "wheel_rate [rad/s]", "change of wheel_angle up to the same row [rad/s]"
        yield Doubt(DoubtKind.ROW, "wheel_angle", sentence, Curves(part.period, rate, names[0], change, names[1]))


def _rest_of_rate(part: LogPart) -> tuple[Regression, bool]:
    """The wheels' rate by the changes of their angle, from `_AHEAD` rows ahead on; whether only these are in it."""
    angle, rate = part.signals["wheel_angle"], part.signals["wheel_rate"]
    change = np.diff(angle, prepend=angle[:1]) / part.period
    there = rate[_BEFORE : len(angle) - _AHEAD]
    fit = regression(there, _rows(change, -_AHEAD, _RATES), part.period)
    return fit, float(np.std(there - fit.fitted)) * part.period < _TICKS * noise_sd(angle)


def _wheels(part: LogPart) -> list[Array]:
    """What the wheels did in the rows before, of which a filter's tilt has some through the accelerometer."""
    if "wheel_angle" in part.signals:
        angle = part.signals["wheel_angle"]
        return _rows(np.diff(angle, prepend=angle[:1]), 1, _STEPS)
    return _rows(part.signals["wheel_rate"], 1, _STEPS)


def _rows(values: Array, first: int, last: int) -> list[Array]:
    """Values `first` to `last` rows before (negative: after), from row `_BEFORE` on."""
    end = len(values) + min(first, 0)
    return [values[_BEFORE - lag : end - lag] for lag in range(first, last + 1)]
