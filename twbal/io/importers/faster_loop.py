"""Whether a log's command seems to be an instant of a control loop that runs faster than the log.

A loop that runs once a row measures once a row: a speed of the wheels that it computes is a change of their path from
row to row, or a filter of such changes. Where a log has a speed that is none, something measured it more often. If the
command answers that speed in its row, and the rows alone tell much less of it, the loop may run faster than the log.
"""

from collections.abc import Sequence

import numpy as np

from twbal.core.block_regression import regression
from twbal.core.gaussian import Array
from twbal.io.importers.all_columns import Column
from twbal.io.importers.checks.rates import changes, integral
from twbal.io.importers.column_names import is_of_wheel_speed
from twbal.io.importers.measured_columns import longest_part, names_of, seconds_of, wheel_path

_FEWEST, _MOST = 200, 20_000  # rows that are looked at
_SAME = 1e-9  # share of the whole path below which two values of it are the same
_SPAN = 8  # rows over which a speed is summed, to see whether it is one of these wheels
_ALIKE = 0.95  # correlation of such sums and of the changes of the path, if it is
_OF_ROW = 0.2  # partial correlation with the path's change up to its row, beside those before and after, if it is
_STEPS, _PAST = 8, 3  # rows of the path's changes, and of other columns, by which commands are predicted
_UNTOLD = 0.01  # share of the command's variance that these do not tell, below which nothing is asked
_ANSWERED = 0.3  # share of that which the speeds tell, from which on the command answers them


def answered_speeds(
    columns: Sequence[Column], command: Sequence[Column], tilt: Sequence[Column], gyro: Sequence[Column]
) -> str:
    """The names of speeds that a command answers and that no loop of the log's rows computes; "" where there are none.

    Args:
        columns: of the log.
        command: columns whose mean is the command, or the voltage or duty cycle in its place.
        tilt: its column.
        gyro: columns of the tilt rate; may be none.
    """
    path = wheel_path(columns)
    if path is None or not tilt or not command:
        return ""
    time = seconds_of(columns)
    signals = [np.mean([c.values for c in command], axis=0), path.values, *(c.values for c in (*tilt, *gyro))]
    part = longest_part(signals, time)
    part = slice(part.start, min(part.stop, part.start + _MOST))
    drive, way, *others = (values[part] for values in signals)
    if len(drive) < _FEWEST or not np.ptp(drive) or not np.ptp(way):
        return ""
    may_be = [column for column in columns if not column.name.strip() or is_of_wheel_speed(column.meaning)]
    speeds = [column for column in may_be if _is_speed(column.values[part], way)]
    if not speeds:
        return ""
    period = 1.0 if time is None else float(np.median(np.diff(time[part])))
    rows = [*_rows(np.diff(way, prepend=way[:1]), 0, _STEPS), *_rows(drive, 1, _PAST), *_rows(way, 0, 0)]
    rows += [row for values in others for row in _rows(values, 0, _PAST)]
    rows += [row for column in speeds for row in _rows(column.values[part], 1, _PAST)]
    now = [row for column in speeds for row in _rows(column.values[part], 0, 0)]
    (answer,) = _rows(drive, 0, 0)
    without, beside = regression(answer, rows, period), regression(answer, [*now, *rows], period)
    untold = 1.0 - without.explained
    if untold < _UNTOLD or 1.0 - beside.explained > (1.0 - _ANSWERED) * untold:
        return ""
    answered = np.column_stack(now) @ beside.coefficients[: len(now)]
    return names_of(speeds) if _is_read_more_often(answered, way) else ""


def _is_speed(values: Array, way: Array) -> bool:
    """Whether a column sums up to the path of the wheels, and has what is new of it in its row: a reference has not."""
    if not np.isfinite(values).all() or not np.ptp(values):
        return False
    summed = integral(values, 1.0)
    sums, paths = changes(summed, _SPAN), changes(way, _SPAN)
    if not np.ptp(sums) or not np.ptp(paths) or abs(np.corrcoef(sums, paths)[0, 1]) < _ALIKE:
        return False
    change = np.diff(way, prepend=way[:1])
    own, *others = [change[_STEPS - lag : len(change) - 2 - lag] for lag in (0, -2, -1, 1, 2, 3)]
    speed = values[_STEPS : len(values) - 2]
    own, speed = (each - regression(each, others, 1.0).fitted for each in (own, speed))
    return bool(np.ptp(own) and np.ptp(speed) and abs(np.corrcoef(own, speed)[0, 1]) > _OF_ROW)


def _is_read_more_often(speed: Array, way: Array) -> bool:
    """Whether a speed, from row `_STEPS` on, is more than the path's changes from row to row and their rounding."""
    fit = regression(speed, _rows(np.diff(way, prepend=way[:1]), 0, _STEPS), 1.0)
    steps = np.diff(np.unique(way))
    digit = float(np.min(steps[steps > _SAME * np.ptp(way)], initial=np.inf))
    return float(np.std(speed - fit.fitted)) > abs(float(fit.coefficients.sum())) * digit


def _rows(values: Array, first: int, last: int) -> list[Array]:
    """Values `first` to `last` rows before, from row `_STEPS` on."""
    return [values[_STEPS - lag : len(values) - lag] for lag in range(first, last + 1)]
