"""What looks wrong with a log that was read: constant channels, units and signs that do not fit together."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from twbal.core.episode import Episode
from twbal.core.gaussian import Array
from twbal.core.plant import Observation

_SURE = 0.25  # correlation from which its sign means something
_HINT = 0.1  # correlation that the other wheel or the body must have for one alone to be wrong: loops mix them up
_ALIKE = (0.6, 1.7)  # slope between a measured rate and one worked out, within which units agree
_LYING = 0.9  # rad; a robot that tilts more does not balance
_LONGEST = 20_000  # samples that are looked at
_SPAN = 0.1  # s over which changes are taken: noise matters less, and what differs in sign or unit does so at any span


def doubts(signals: Mapping[str, Array], episodes: Sequence[Episode]) -> Iterator[str]:
    """Sentences on what a person should look at.

    Args:
        signals: as mapped, before anything was worked out.
        episodes: what was made of them.
    """
    for name, values in signals.items():
        if name != "time" and np.ptp(values) == 0.0:
            yield f"{name} is {values[0]:g} throughout: its sensor was off, or it is another column"
    longest = max(episodes, key=len)
    tilt = longest.tilt
    if np.median(np.abs(tilt)) > _LYING:
        yield (
            f"the robot lies: its tilt is {np.degrees(np.median(tilt)):.0f}° (0 is upright). Is that so, or is tilt "
            "counted from elsewhere (mend `offset`)?"
        )
        return
    yield from _rates(longest, set(signals))
    yield from _physics(longest)


def _rates(episode: Episode, measured: set[str]) -> Iterator[str]:
    """Measured rates against what the measured angles make them."""
    part = episode.observations[:_LONGEST]
    span = _samples(len(part), episode.control_period)
    for angle, rate in (("tilt", "tilt_rate"), ("wheel_angle", "wheel_rate")):
        if rate not in measured or any(e.channel == angle for e in episode.estimated):
            continue
        values = part[:, Observation._fields.index(rate)]
        said = _sums(0.5 * (values[1:] + values[:-1]), span)
        worked_out = _changes(part[:, Observation._fields.index(angle)], span) / episode.control_period
        correlation, slope = _related(worked_out, said)
        if correlation < -_SURE:
            yield f"{rate} runs against {angle}: one of them has the wrong sign"
        elif correlation > 2 * _SURE and not _ALIKE[0] < slope < _ALIKE[1]:
            yield f"{rate} is {slope:.3g} times as fast as {angle} changes: is one of them in another unit?"


def _physics(episode: Episode) -> Iterator[str]:
    """Signs against mechanics: a torque drives the wheels forward and the body back, and a leaning body falls.

    What the speed of the wheels tells is taken off, too: friction and back-EMF brake, and a robot that keeps its speed
    by a large command would else seem to be slowed down by it.
    """
    part = episode.observations[: _LONGEST + 1]
    commands = episode.commands[: len(part) - 1]
    span = _samples(len(part), episode.control_period)
    body = _changes(part[:, Observation._fields.index("tilt_rate")], span)
    wheels = _changes(part[:, Observation._fields.index("wheel_rate")], span)
    if min(np.ptp(commands), np.ptp(episode.tilt)) == 0.0:
        return
    others = [_sums(part[:-1, Observation._fields.index(name)], span) for name in ("tilt", "wheel_rate")]
    commands = _sums(commands, span)
    driven, turned = _partial(wheels, commands, others), _partial(body, commands, others)
    if driven < -_SURE and turned > _SURE:
        yield "the command seems to have the wrong sign: a positive one must drive the wheels forward"
    elif driven < -_SURE and turned < -_HINT:
        yield "the wheels seem to have the wrong sign: a positive command must drive them forward"
    elif turned > _SURE and driven > _HINT:
        yield "the tilt seems to have the wrong sign: a positive command must turn the body back"


def _samples(count: int, period: float) -> int:
    """Samples in `_SPAN`, of which `count` have several."""
    return max(1, min(round(_SPAN / period), count // 4))


def _changes(values: Array, span: int) -> Array:
    return values[span:] - values[:-span]


def _sums(values: Array, span: int) -> Array:
    """Sums of `span` values in a row."""
    return _changes(np.concatenate([[0.0], np.cumsum(values)]), span)


def _related(x: Array, y: Array) -> tuple[float, float]:
    """Correlation of two signals, and the slope of y over x, of equal standing."""
    x, y = x - x.mean(), y - y.mean()
    spread = float(np.sqrt((x @ x) * (y @ y)))
    correlation = float(x @ y) / spread if spread else 0.0
    return correlation, float(np.sqrt((y @ y) / (x @ x))) if x @ x else 1.0


def _partial(y: Array, x: Array, others: Sequence[Array]) -> float:
    """Correlation of y and x, with what `others` tell of both taken off."""
    A = np.column_stack([np.ones(len(y)), *others])
    rest = [v - A @ np.linalg.lstsq(A, v, rcond=None)[0] for v in (x, y)]
    return _related(*rest)[0]
