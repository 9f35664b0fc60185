"""Angles that jump within one sample: those that wrap round, and single samples that are far off their neighbours.

A jump stands alone: the angle's step differs from those before it and from those after it, far more than any other
step nearby does, and by more than a motor or a push can do. An encoder's ticks, a fall, a push, and a wheel that
speeds up all change several steps in a row, or change them less.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from twbal.core.gaussian import Array
from twbal.io.importers.checks.doubt import Curves, Doubt, DoubtKind, LogPart

_SIDE = 5  # steps before and after, whose medians are what a step should be
_NEARBY = 25  # steps before and after that tell how large ordinary changes are
_TIMES = 8.0  # a jump is so many times larger than all ordinary changes nearby
_TICKS = 3.0  # and than so many ticks of an encoder
_TICK, _TURNED = 0.1, 5  # quantile of an angle's changes that is a tick, and how many changes tell it
_ALIKE = 0.6  # of a jump's size, from which other changes are jumps as well
_MOST = 0.25  # share of the steps nearby that may be jumps: wheels that turn once in four samples wrap so often
_OF_TURN = 0.5  # rad by which a step of a whole turn may be off: the tilt moves meanwhile
_RETURN = 0.5  # of a spike's size, by which its two steps differ at most


class Limit(NamedTuple):
    """What an angle can do within one sample.

    Attributes:
        least: size below which nothing is called a jump [rad].
        acceleration: largest that changes an angle's steps [rad/s²].
        most: size from which a jump is one at any period [rad].
    """

    least: float
    acceleration: float
    most: float


WHEEL = Limit(1.0, 2000.0, 5.0)
"""A free wheel of a small motor reaches 1000 to 2000 rad/s²."""

TILT = Limit(0.2, 200.0, 1.0)
"""A body of 0.05 m that is hit."""


class Jumps(NamedTuple):
    """Where an angle jumps.

    Attributes:
        sizes: (n - 1,) by which each step is too large, 0.0 at ordinary ones [rad].
        spikes: samples that are off alone: the steps to and from them are both jumps.
        steps: samples from which on the angle is another one.
    """

    sizes: Array
    spikes: NDArray[np.int64]
    steps: NDArray[np.int64]


def jumps(values: Array, period: float, limit: Limit) -> Jumps:
    """Where an angle of (n,) samples jumps [rad]."""
    changes = np.diff(values)
    if len(changes) < 2 * _SIDE:
        none = np.zeros(0, dtype=np.int64)
        return Jumps(np.zeros(len(changes)), none, none)
    excess = _excess(changes)
    least = max(float(np.clip(limit.acceleration * period**2, limit.least, limit.most)), _TICKS * _tick(changes))
    sizes = np.zeros(len(changes))
    for at in np.flatnonzero(np.abs(excess) > least):
        nearby = np.abs(excess[max(at - _NEARBY, 0) : at + _NEARBY + 1]) / abs(excess[at])
        is_jump = nearby > _ALIKE
        if (is_jump | (nearby < 1.0 / _TIMES)).all() and is_jump.sum() <= max(_MOST * len(nearby), 2):
            sizes[at] = excess[at]
    spikes: list[int] = []
    steps: list[int] = []
    for place in map(int, np.flatnonzero(sizes)):
        if steps and steps[-1] == place and abs(sizes[place - 1] + sizes[place]) < _RETURN * abs(sizes[place]):
            spikes.append(steps.pop())
        else:
            steps.append(place + 1)
    return Jumps(sizes, np.array(spikes, dtype=np.int64), np.array(steps, dtype=np.int64))


def _excess(changes: Array) -> Array:
    """By how much each step differs from the median of those before or of those after it, whichever is nearer, (m,)."""
    padded = np.pad(changes, _SIDE, mode="reflect")
    medians = np.median(sliding_window_view(padded, _SIDE), axis=1)  # of the `_SIDE` values from each place on
    before, after = changes - medians[: len(changes)], changes - medians[_SIDE + 1 :][: len(changes)]
    nearer = np.where(np.abs(before) < np.abs(after), before, after)
    return np.where(before * after > 0.0, nearer, 0.0)


def _tick(changes: Array) -> float:
    """Size of a coarse encoder's tick, or more than that; 0.0 where an angle hardly changes."""
    turned = np.abs(changes[changes != 0.0])
    return float(np.quantile(turned, _TICK)) if len(turned) >= _TURNED else 0.0


def repaired(values: Array, found: Jumps) -> Array:
    """An angle without its jumps, (n,), for further checks."""
    if not found.sizes.any():
        return values
    jumped: Array = np.concatenate([[0.0], np.cumsum(found.sizes)])
    return values - jumped


def without_jumps(part: LogPart) -> tuple[list[Doubt], LogPart]:
    """Sentences on angles that jump, and the log without these jumps."""
    doubts: list[Doubt] = []
    signals, sides = dict(part.signals), dict(part.sides)
    if _wraps_round(signals["tilt"]):
        doubts.append(_wrap_doubt(part))
        signals["tilt"] = _unwrapped(signals["tilt"])
    tilt = jumps(signals["tilt"], part.period, TILT)
    if len(tilt.spikes):
        doubts += _doubts(part, "tilt", "the tilt", signals["tilt"], tilt._replace(steps=tilt.steps[:0]))
        signals["tilt"] = _interpolated(signals["tilt"], tilt.spikes)
    if "wheel_angle" in signals:
        whole = signals["wheel_angle"]
        found = jumps(whole, part.period, WHEEL)
        signals["wheel_angle"] = repaired(whole, found)
        named = [("the wheel angle", whole, found)]
        if "wheel_angle" in sides:
            pair = sides["wheel_angle"]
            both = [jumps(values, part.period, WHEEL) for values in pair]
            sides["wheel_angle"] = repaired(pair[0], both[0]), repaired(pair[1], both[1])
            of_sides = ("the left wheel's angle", pair[0], both[0]), ("the right wheel's angle", pair[1], both[1])
            named = [each for each in of_sides if each[2].sizes.any()] or named
        for name, values, each in named:
            doubts += _doubts(part, "wheel_angle", name, values, each)
    return doubts, part._replace(signals=signals, sides=sides)


def _wraps_round(angle: Array) -> bool:
    """Whether an angle has steps of more than half a turn, and all of these are of a whole turn."""
    steps = np.abs(np.diff(angle))
    large = steps[steps > np.pi]
    return bool(len(large)) and bool((np.abs(large - 2.0 * np.pi) < _OF_TURN).all())


def _unwrapped(angle: Array) -> Array:
    """An angle without its steps of a whole turn, whose median is within half a turn of 0."""
    whole = np.unwrap(angle)
    return whole - 2.0 * np.pi * np.round(np.median(whole) / (2.0 * np.pi))


def _wrap_doubt(part: LogPart) -> Doubt:
    tilt = part.signals["tilt"]
    steps = np.flatnonzero(np.abs(np.diff(tilt)) > np.pi)
    time = part.signals.get("time", part.period * np.arange(len(tilt)))
    places = "" if len(steps) == 1 else f" in {len(steps)} places, such as"
    sentence = (
        f"the tilt jumps by a whole turn{places} at {time[steps[0] + 1]:.6g} s: it wraps round. Tell the range of its "
        "column in the mapping, as {from: ..., wraps: 360} for degrees or wraps: 6.28319 for radians; where it is not "
        "about 0 then, mend `offset`"
    )
    return Doubt(DoubtKind.JUMP, "tilt", sentence, Curves(part.period, tilt, "tilt [rad]"))


def _doubts(part: LogPart, quantity: str, name: str, values: Array, found: Jumps) -> Iterator[Doubt]:
    """A sentence on the jumps of one angle, if it has any."""
    where = np.sort(np.concatenate([found.spikes, found.steps]))
    if not len(where):
        return
    time = part.signals.get("time", part.period * np.arange(len(values)))
    sizes = np.abs(found.sizes[where - 1])
    low, high = f"{sizes.min():.3g}", f"{sizes.max():.3g}"
    size = low if low == high else f"{low} to {high}"
    at = f"{time[where[0]]:.6g} s"
    if len(found.steps):
        places = f"at {at}" if len(where) == 1 else f"in {len(where)} places, such as at {at}"
        sentence = (
            f"{name} jumps by {size} rad {places}: does it wrap round, or are these faulty samples? Tell the range of "
            f"its column in the mapping, as {{from: ..., wraps: 360}} for degrees or wraps: 65536 for a counter of 16 "
            "bits; or empty these fields"
        )
    else:
        places = f"at {at}" if len(where) == 1 else f"in {len(where)} samples, such as at {at}"
        sentence = (
            f"{name} is {size} rad off its neighbours {places}: are these faulty samples? Empty these fields to have "
            "them interpolated"
        )
    yield Doubt(DoubtKind.JUMP, quantity, sentence, Curves(part.period, values, f"{quantity} [rad]"))


def _interpolated(values: Array, wrong: NDArray[np.int64]) -> Array:
    """Values with some of them taken from their neighbours."""
    right = np.setdiff1d(np.arange(len(values)), wrong)
    return np.interp(np.arange(len(values)), right, values[right])
