"""Whether a rate of the wheels is that of its row: a mean over several loops, or a filter, makes it late."""

from collections.abc import Sequence

import numpy as np

from twbal.core.block_regression import regression
from twbal.core.gaussian import Array
from twbal.io.importers.all_columns import Column
from twbal.io.importers.checks.rates import LATE, LATE_ROWS, changes, turned
from twbal.io.importers.measured_columns import longest_part, seconds_of, wheel_path

_WINDOWS = range(1, 13)  # rows over which a rate may be the mean one
_EXACT = 0.9999  # share of a rate's variance that such a mean explains, if it is one
_SPAN = 0.3  # s over which changes are taken of a rate that is none
_ALIKE = 0.9  # correlation of rate and changes, from which on a lag is told
_FEWEST = 10  # spans


def lateness_of(rate: Sequence[Column], columns: Sequence[Column]) -> str:
    """What is to be said of a rate of the wheels that comes late after their angle; "" where it does not.

    Args:
        rate: columns whose mean it is, with any sign and unit.
        columns: of the log.
    """
    time, path = seconds_of(columns), wheel_path(columns)
    if time is None or path is None:
        return ""
    rates = np.mean([column.values for column in rate], axis=0)
    part = longest_part([path.values, rates], time)
    time, way, rates = time[part], path.values[part], rates[part]
    period = float(np.median(np.diff(time))) if len(time) > 1 else np.inf
    if len(time) * period < _FEWEST * _SPAN or len(time) < _FEWEST * _WINDOWS[-1] or not np.ptp(way) * np.ptp(rates):
        return ""
    names, limit = " and ".join(column.name for column in rate), LATE_ROWS + LATE / period
    instead = "the rate is worked out of the angle instead"
    rows, share = _window(way, rates, period)
    if share > _EXACT:
        late = f"{names} is the mean rate of {path.name} over the last {rows} rows, {500 * rows * period:.0f} ms late"
        return f"{late}: {instead}" if 0.5 * rows > limit else ""
    late_rows, half = _lag(way, rates, period)
    if late_rows - half <= limit:
        return ""
    late = (
        f"{names} comes some {1e3 * late_rows * period:.0f} ms ({late_rows:.1f} rows) after the changes of {path.name}"
    )
    return f"{late}, as a mean over several loops does: {instead}"


def _window(way: Array, rates: Array, period: float) -> tuple[int, float]:
    """Rows over which the changes of an angle are most like a rate, and the share of its variance that they explain."""
    first = _WINDOWS[-1]
    explained = {
        rows: regression(rates[first:], [changes(way, rows)[first - rows :]], period).explained for rows in _WINDOWS
    }
    best = max(explained, key=lambda rows: explained[rows])
    return best, explained[best]


def _lag(way: Array, rates: Array, period: float) -> tuple[float, float]:
    """Rows by which a rate comes after the changes of an angle, with the half-width of their interval.

    The rate's sum over time is the angle some time ago, s(t) = c φ(t - late): the changes of s over a span are
    c (Δφ - late Δφ'). Infinite where the two hardly go together.
    """
    span = max(round(_SPAN / period), 1)
    changed, summed = changes(way, span), turned(rates, span, period)
    fit = regression(summed, [changed, np.gradient(changed)], period)  # the second for a row
    scale = float(fit.coefficients[0])
    if not scale or fit.explained < _ALIKE**2:
        return 0.0, np.inf
    return -float(fit.coefficients[1]) / scale, abs(float(fit.half_widths[1]) / scale)
