"""Values that no balancing robot has: channels that stand still, tilts of turns, drives that push one way only."""

from collections.abc import Iterator, Mapping

import numpy as np

from twbal.core.gaussian import Array
from twbal.core.smoothed_derivatives import noise_sd
from twbal.io.importers.checks.doubt import Curves, Doubt, DoubtKind, LogPart
from twbal.io.importers.checks.wheel_sides import SCALE_OF_EACH

BEYOND = 3.0
"""Times the torque limit, from which a command is none: sheets often have less than the stall torque."""
_LYING = 0.9  # rad; a robot that tilts more does not balance
_LYING_TIME = 0.3  # s, from which on that is no sample that is off
_UPRIGHT = 0.2  # rad; a robot that tilts less after it lay may balance
_SOON = 1.0  # s from the beginning, where a robot may be put down or switched on
_STILL = 0.15  # rad by which the tilt of a robot that lies changes at most
_WHOLE_TURN = 6.3  # rad; no tilt is more
_PERIODS = (0.0005, 0.3)  # s; of what balances
_ONE_WAY = 0.995  # share of the commands of one sign from which a drive has none
_SMOOTH, _SMOOTHER = 0.02, 0.25  # noise per standard deviation, of itself and per that of the tilt rate
_NOISY = 0.01  # noise per standard deviation of a tilt rate, from which it is no smooth motion
_SPREAD = 1.5  # standard deviations from zero of the mean of commands of one sign that are about a value of their own
_BACK = 0.1  # share of the way that tilt and wheels must go back, so that a drive of one sign cannot be


def constant_doubts(signals: Mapping[str, Array], sides: Mapping[str, tuple[Array, Array]]) -> Iterator[Doubt]:
    """Sentences on channels that never change; `sides` are those of the left and of the right wheel."""
    for name, values in signals.items():
        if name != "time" and np.ptp(values) == 0.0:
            if name in sides and np.ptp(sides[name][0]) > 0.0:
                of_both = f"the mean of both wheels' {name} is {values[0]:g} throughout, and each moves"
                yield Doubt(DoubtKind.SIGN, name, f"{of_both}: {SCALE_OF_EACH}")
                continue
            sentence = f"{name} is {values[0]:g} throughout: its sensor was off, or it is another column"
            yield Doubt(DoubtKind.COLUMN, name, sentence)


def period_doubts(part: LogPart) -> Iterator[Doubt]:
    """A sentence on a time between samples at which nothing can balance."""
    if not _PERIODS[0] <= part.period <= _PERIODS[1]:
        sentence = (
            f"a sample every {part.period:.3g} s is none of a balancing robot ({_PERIODS[0]:g} to {_PERIODS[1]:g} s): "
            "is the unit of time wrong?"
        )
        yield Doubt(DoubtKind.TIME, "time", sentence)


def torque_doubts(part: LogPart) -> Iterator[Doubt]:
    """A sentence on commands far beyond what the robot's motors can give."""
    largest = float(np.abs(part.commands).max(initial=0.0))
    if part.robot is not None and largest > BEYOND * part.robot.torque_limit:
        sentence = (
            f"the command reaches {largest:.3g} N·m, and the sheet of robot {part.robot.name!r} has a torque_limit of "
            f"{part.robot.torque_limit:.3g} N·m: is it no torque (a voltage or duty cycle belongs to `voltage`), or is "
            "its unit, its scale or the motor another?"
        )
        yield Doubt(DoubtKind.UNIT, "command", sentence, Curves(part.period, part.commands, "command [N·m]"))


def tilt_doubts(part: LogPart) -> Iterator[Doubt]:
    """A sentence on a robot that lies, or on a tilt that no robot has."""
    tilt = part.signals["tilt"]
    middle, spread = float(np.median(tilt)), float(np.ptp(np.quantile(tilt, [0.01, 0.99])))
    evidence = Curves(part.period, tilt, "tilt [rad]")
    if np.median(np.abs(tilt)) <= _LYING and np.abs(tilt).max() <= _WHOLE_TURN:
        return
    if spread > _STILL * max(abs(middle), 1.0) or np.abs(tilt).max() > _WHOLE_TURN:
        origin = float(np.round(middle / (0.5 * np.pi)) * 0.5 * np.pi)
        elsewhere = f", or is it counted from {np.degrees(origin):.0f}° (mend `offset`: {-origin:.4g})"
        is_elsewhere = origin != 0.0 and np.abs(tilt - origin).max() < _LYING
        hundredths = "or in hundredths of a degree, " if np.abs(tilt).max() > _WHOLE_TURN else ""
        sentence = (
            f"the tilt goes from {tilt.min():.3g} to {tilt.max():.3g} rad, which no robot that balances does: is it in "
            f"degrees, {hundredths}or another column{elsewhere if is_elsewhere else ''}?"
        )
        yield Doubt(DoubtKind.UNIT, "tilt", sentence, evidence)
    else:
        sentence = (
            f"the robot lies: its tilt is {np.degrees(middle):.0f}° (0 is upright). Is that so, or is tilt counted "
            "from elsewhere (mend `offset`)?"
        )
        yield Doubt(DoubtKind.LYING, "tilt", sentence, evidence)


def lying_part_doubts(part: LogPart) -> Iterator[Doubt]:
    """A sentence on a robot that lies or is held before it balances: later stages use a log up to there."""
    tilt = part.signals["tilt"]
    lies = np.abs(tilt) > _LYING
    share = float(part.period * lies.sum())
    first = int(np.argmax(lies))
    stands = np.flatnonzero(np.abs(tilt[first:]) < _UPRIGHT)
    if share < _LYING_TIME or not len(stands):  # one that falls at the end does no harm
        return
    till = part.period * (first + stands[0])
    is_begin = part.period * first < _SOON
    advice = f"give import.skip={np.ceil(10.0 * till) / 10.0:.1f}" if is_begin else "cut the file there into two"
    sentence = (
        f"the robot lies or is held for {share:.2g} s, first from {part.period * first:.3g} s to {till:.3g} s with a "
        f"tilt of {np.degrees(tilt[first]):.0f}° (0 is upright), and later stages use nothing after that: {advice}"
    )
    yield Doubt(DoubtKind.LYING, "tilt", sentence, Curves(part.period, tilt, "tilt [rad]"))


def smooth_command_doubts(part: LogPart) -> Iterator[Doubt]:
    """A sentence on commands without the noise of the sensors: a regulator answers these, and so has it."""
    commands = part.commands
    rate = part.signals.get("tilt_rate", np.diff(part.signals["tilt"]))
    if not np.ptp(commands) or not np.ptp(rate):
        return
    noise, sensed = (noise_sd(values) / float(np.std(values)) for values in (commands, rate))
    if sensed > _NOISY and noise < min(_SMOOTH, _SMOOTHER * sensed):
        sentence = (
            "the command is far smoother than the sensors, so that it cannot answer them: is it what was asked for, or "
            "another column?"
        )
        yield Doubt(DoubtKind.COLUMN, "command", sentence, Curves(part.period, commands, "command [N·m]"))


def one_way_doubts(part: LogPart) -> Iterator[Doubt]:
    """A sentence on commands of one sign: who balances must drive both ways.

    The size of a command comes down to zero again and again. So does that of a robot that only falls or rolls away,
    which is right: there, tilt and wheels go one way, too.
    """
    commands = part.commands
    spread = float(np.std(commands))
    shares = {"negative": float(np.mean(commands >= 0.0)), "positive": float(np.mean(commands <= 0.0))}
    lacks = max(shares, key=lambda sign: shares[sign])
    if not spread or shares[lacks] <= _ONE_WAY:
        return
    if abs(float(commands.mean())) > _SPREAD * spread or _go_back_and_forth(part):
        sentence = (
            f"the command is {'never' if shares[lacks] == 1.0 else 'hardly ever'} {lacks}: is it the size of a duty "
            "cycle, whose direction stands in another column, or a battery's voltage? Or has it an offset (0..255 with "
            "rest at 128)?"
        )
        yield Doubt(DoubtKind.COLUMN, "command", sentence, Curves(part.period, commands, "command [N·m]"))


def _go_back_and_forth(part: LogPart) -> bool:
    """Whether tilt and wheels both go a good part of their way in either direction."""
    signals = part.signals
    wheels = np.diff(signals["wheel_angle"]) if "wheel_angle" in signals else signals["wheel_rate"]
    both = np.diff(signals["tilt"]), wheels
    return all(min(np.maximum(way, 0.0).sum(), np.maximum(-way, 0.0).sum()) > _BACK * np.abs(way).sum() for way in both)
