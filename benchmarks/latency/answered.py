"""When a person's input is answered, by the logs of a drive."""

from collections.abc import Sequence
from math import inf

import numpy as np
from numpy.typing import NDArray

_WRAP = 2**32  # of the robot's clock [µs]
_STILL = 1e-9  # of a reference's speed and acceleration [m/s], [m/s²]


def moving(references: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(T,) whether the reference moves, of its (T, 3) places, speeds and accelerations."""
    return np.asarray(np.abs(references[:, 1:]).max(axis=1) > _STILL)


def answers(
    presses: Sequence[float], measured: NDArray[np.int64], taken: NDArray[np.int64], moves: NDArray[np.bool_]
) -> list[float]:
    """How long after each press the robot had the first command that follows a moving reference [s].

    Args:
        presses: times on the clock of the robot, which is this computer's monotonic one [s].
        measured: (N,) time of each observation, on that clock modulo 2³² [µs].
        taken: (N,) time at which the robot had the command that answers it [µs].
        moves: (N,) whether the reference of that command moves.

    Returns:
        For each press; infinite where nothing moved after it. NaN where it moved already, so that nothing can be said.
    """
    return [_answer(press, measured, taken, moves) for press in presses]


def _answer(press: float, measured: NDArray[np.int64], taken: NDArray[np.int64], moves: NDArray[np.bool_]) -> float:
    since = _signed(measured - int(press * 1e6))  # of each observation, since the press [µs]
    before = moves[since < 0]
    if before.size == 0 or before[-1]:
        return float("nan")
    (later,) = np.nonzero((since >= 0) & moves)
    return inf if later.size == 0 else float(_signed(taken[later[:1]] - int(press * 1e6))[0]) * 1e-6


def _signed(difference: NDArray[np.int64]) -> NDArray[np.int64]:
    """Of two times modulo 2³², at most half a turn apart [µs]."""
    return (difference + _WRAP // 2) % _WRAP - _WRAP // 2
