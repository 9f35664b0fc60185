"""Rows that a log has lost: what was measured and commanded there, by what the rows around them show."""

import numpy as np

from twbal.core.gaussian import Array, Mask

_LAGS = 3  # commands that move the robot in one control period: the present one, and two that may act late
_ENOUGH = 10  # whole rows for each coefficient of the regression, at least
_LEAST = 1e-9  # share of a channel's variance that counts as noise where a regression leaves less


def refilled(values: Array, commands: Array, measured: Mask) -> tuple[Array, Array]:
    """Values and commands in which single lost rows are those that the others make likeliest.

    Where a row was lost its command is not known either, though the robot got one. From row to row the robot is nearly
    linear: changes of the values are regressed on the values and the last three commands, over all rows that are there.
    By that, the lost values follow from the row before, and the lost command is the one by which the three changes
    after it are likeliest, with a prior about the command before it. Channels that a straight line between their
    neighbours meets better keep what they have. Rows that were lost side by side, or at an end, are left as they are,
    and all are where a recording is too short.

    Args:
        values: (K + 1, C), on a straight line between the others where a row was lost.
        commands: (K,), with the command before it where a row was lost.
        measured: (K + 1,), False where a row was lost.

    Returns:
        values (K + 1, C) and commands (K,).
    """
    count = len(commands)
    first = _LAGS - 1
    known = measured[:-1]
    lagged = np.column_stack([commands[first - lag : count - lag] for lag in range(_LAGS)])  # of transitions from first
    whole = measured[first:-1] & measured[first + 1 :]
    whole &= np.all([known[first - lag : count - lag] for lag in range(_LAGS)], axis=0)
    regressors = np.column_stack([values[first:-1], lagged, np.ones(count - first)])
    single = _single(measured, first)
    if whole.sum() < _ENOUGH * regressors.shape[1] or not len(single):
        return values, commands
    scales = np.maximum(np.abs(regressors[whole]).max(axis=0), np.finfo(float).tiny)
    changes = np.diff(values[first:], axis=0)
    fitted = np.linalg.lstsq(regressors[whole] / scales, changes[whole], rcond=None)[0] / scales[:, None]
    left = changes[whole] - regressors[whole] @ fitted
    moving = np.flatnonzero(changes[whole].std(axis=0) > 0.0)
    floor = _LEAST * changes[whole][:, moving].var(axis=0)
    precision = np.linalg.inv(np.atleast_2d(np.cov(left[:, moving].T)) + np.diag(floor))
    by_command = fitted[-1 - _LAGS : -1, moving]  # of the present command, and of those one and two periods before
    prior = 1.0 / max(float(np.var(np.diff(commands))), np.finfo(float).tiny)
    off_line = 0.5 * np.diff(changes, axis=0)[whole[1:] & whole[:-1]]  # of known rows, from between their neighbours
    is_better = left.std(axis=0) < off_line.std(axis=0)
    values, commands = values.copy(), commands.copy()
    for row in single:
        values[row] = np.where(is_better, values[row - 1] + regressors[row - 1 - first] @ fitted, values[row])
        weight, found = prior, prior * commands[row - 1]
        for lag, effect in enumerate(by_command):
            at = row + lag
            given = commands[at - np.arange(_LAGS)] * (np.arange(_LAGS) != lag)
            expected = np.concatenate([values[at], given, [1.0]]) @ fitted
            off = (values[at + 1] - values[at] - expected)[moving]
            weight += effect @ precision @ effect
            found += effect @ precision @ off
        commands[row] = found / weight
    return values, commands


def _single(measured: Mask, first: int) -> Array:
    """Lost rows whose neighbours within reach of a command, either way, are all there."""
    lost = np.flatnonzero(~measured)
    inside = lost[(lost > first + 1) & (lost + _LAGS < len(measured))]
    reach = [n for n in range(-first - 1, _LAGS + 1) if n]
    return np.array([row for row in inside if measured[row + np.array(reach)].all()], int)
