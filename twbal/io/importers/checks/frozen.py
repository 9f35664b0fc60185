"""Channels that stop in the middle of a log: an IMU that hangs, an encoder that came loose, a command that was lost."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from twbal.core.gaussian import Array
from twbal.io.importers.checks.doubt import Curves, Doubt, DoubtKind, LogPart

_IMU, _WHEEL = 0.3, 1.0  # s of the same value, below which nothing is said; a wheel may rest for long
_TIMES = 12.0  # means of all other times of the same value, as coarse sensors and held rows have them
_MOVES = 0.5  # of the standard deviation over the log, from which a channel moves meanwhile
_TURNS = 0.1  # rad, from which a wheel has turned meanwhile
_ROWS = 3  # the same value so many times at least


def frozen_doubts(part: LogPart) -> Iterator[Doubt]:
    """Sentences on sensors that say the same for long while the robot moves."""
    signals, commands = part.signals, part.commands
    tilt = signals["tilt"]
    wheels = part.sides.get("wheel_angle") or ((signals["wheel_angle"],) if "wheel_angle" in signals else ())
    if "tilt_rate" in signals:
        still = _longest_still([tilt, signals["tilt_rate"]])
        if _is_long(still, part.period, _IMU) and (_moves(commands, still[0]) or _turn(wheels, still[0])):
            yield _doubt(part, "tilt", "tilt and tilt_rate stand", "the IMU", still[0])
    names = ("left_wheel", "right_wheel") if len(wheels) == 2 else ("wheel_angle",)
    for name, angle in zip(names, wheels, strict=False):
        still = _longest_still([angle])
        if _is_long(still, part.period, _WHEEL) and _moves(commands, still[0]) and _moves(tilt, still[0]):
            yield _doubt(part, "wheel_angle", f"{name} stands", "its encoder", still[0])


def _longest_still(channels: Sequence[Array]) -> tuple[slice, float]:
    """The longest run of rows in which no channel changes, and how many rows other runs have in the mean."""
    changes = np.any([np.diff(channel) != 0.0 for channel in channels], axis=0)
    ends = np.flatnonzero(np.concatenate([[True], changes, [True]]))
    lengths: NDArray[np.int64] = np.diff(ends)
    longest = int(np.argmax(lengths))
    others = np.delete(lengths, longest)
    mean = float(others.mean()) if len(others) else float(lengths[longest])
    return slice(int(ends[longest]), int(ends[longest + 1])), mean


def _is_long(still: tuple[slice, float], period: float, least: float) -> bool:
    rows, mean = still
    count = rows.stop - rows.start
    return bool(count >= _ROWS and count * period >= least and count >= _TIMES * mean)


def _moves(values: Array, rows: slice) -> bool:
    """Whether a channel moves in these rows nearly as much as elsewhere."""
    return bool(len(values[rows]) > 1 and np.std(values[rows]) > _MOVES * np.std(values) > 0.0)


def _turn(wheels: Sequence[Array], rows: slice) -> bool:
    return any(float(np.ptp(angle[rows])) > _TURNS for angle in wheels)


def _doubt(part: LogPart, quantity: str, what: str, sensor: str, rows: slice) -> Doubt:
    time = part.signals.get("time", part.period * np.arange(len(part.signals["tilt"])))
    begin, end = (f"{time[at]:.6g}" for at in (rows.start, rows.stop - 1))
    sentence = (
        f"{what} still from {begin} s to {end} s, to the last digit, while the robot moves: {sensor} was not read "
        "then. Cut the file there"
    )
    evidence = Curves(part.period, part.signals[quantity], f"{quantity} [rad]")
    return Doubt(DoubtKind.COLUMN, quantity, sentence, evidence)
