"""Which row a command belongs to, by causality.

A command that acts from one sample to the next cannot answer the measurement at the end of that time, nor can the body
answer a command that is given later. What is new in a measurement (its error of prediction from all rows before) tells:
a regulator answers it by a command of the same sign, mechanics answers a command by a turning rate of the other sign.
"""

from collections.abc import Iterator

import numpy as np

from twbal.core.block_regression import Regression, regression
from twbal.core.gaussian import Array
from twbal.io.importers.checks.doubt import Curves, Doubt, DoubtKind, LogPart

_CREEP = 0.3  # rad/s below which dry friction has not its full size
_PAST = 4  # rows of measurements from which the next one is predicted
_ANSWERED = (
    0.25  # partial correlation from which it is the measurement: regulators may know the state better than the log
)
_LITTLE = 0.3  # of the answer to the row before, below which a command does not answer that of its own row
_CLIPPED, _END = 0.05, 0.001  # share of commands at their limits, and of their range that counts as a limit


def command_row_doubts(part: LogPart) -> Iterator[Doubt]:
    """Sentences on commands that stand a row too early or too late."""
    commands = part.commands
    if part.is_sampled or np.ptp(commands) == 0.0 or len(commands) < 20 * _PAST:
        return
    rate = _rate(part, "tilt", "tilt_rate")
    wheels = _rate(part, "wheel_angle", "wheel_rate")
    new = rate[_PAST:-1]  # at k + 1, from _PAST on
    past = [
        values[_PAST - 1 - lag : len(values) - 2 - lag]
        for values in (rate, wheels, np.tanh(wheels / _CREEP), part.signals["tilt"])
        for lag in range(_PAST - 1)
    ]
    earlier = [commands[_PAST - 1 - lag : len(commands) - 1 - lag] for lag in range(_PAST)]  # first: of this time
    later = commands[_PAST : len(commands)]
    if _is_clipped(commands):
        sentence = "which row the commands belong to: they stand at their limits. Drive more gently"
        yield Doubt(DoubtKind.UNTOLD, "command", sentence)
        return
    early, correlation = _partial(new, earlier[0], [*past, *earlier[1:]], part.period)
    if early.coefficients[0] > early.half_widths[0] and correlation > _ANSWERED:
        if "tilt_rate" not in part.signals:
            sentence = (
                "which row the commands belong to: they answer what the tilt does in the row after them, but a rate "
                "that is differenced from it spreads over rows. Log the gyro's rate"
            )
            yield Doubt(DoubtKind.UNTOLD, "command", sentence)
            return
        sentence = (
            "the command answers the measurement of the row after it, which it cannot know: commands stand a row too "
            f"early{_advice(part, False)}"
        )
        yield Doubt(DoubtKind.ROW, "command", sentence, _evidence(part, commands[_PAST - 1 : -1], new))
        return
    own, answered = _partial(new, later, [*past, *earlier], part.period)
    count = len(new) - 1
    columns = [column[:count] for column in (*past, *earlier, later)]
    following, then = _partial(new[:count], commands[_PAST + 1 :], columns, part.period)
    if own.coefficients[0] < -own.half_widths[0] and then > 0.0:
        sentence = (
            f"the body answers the command a row before it is given: commands stand a row too late{_advice(part, True)}"
        )
        yield Doubt(DoubtKind.ROW, "command", sentence, _evidence(part, -later, new, "-command"))
        return
    if own.coefficients[0] < -own.half_widths[0]:
        sentence = (
            "the command answers the measurements of its row and of the next one against them: it seems to have the "
            "wrong sign"
        )
        yield Doubt(DoubtKind.SIGN, "command", sentence, _evidence(part, later, new))
        return
    answers, answers_then = _is_positive(own), _is_positive(following)
    if answers_then and not answers and then > _ANSWERED and abs(answered) < _LITTLE * then:
        sentence = (
            "the command answers the measurement of the row before it, and not that of its own: commands stand a row "
            f"too late{_advice(part, True)}, unless the control loop itself takes a period to answer"
        )
        yield Doubt(DoubtKind.ROW, "command", sentence, _evidence(part, commands[_PAST + 1 :], new[:count]))
    elif not (answers and answered > _ANSWERED) and early.coefficients[0] > -early.half_widths[0]:
        sentence = (
            "which row the commands belong to: they hardly answer any measurement, nor the body them. Drive with "
            "less noise on the command, or log more digits"
        )
        yield Doubt(DoubtKind.UNTOLD, "command", sentence)


def _is_positive(fit: Regression) -> bool:
    return bool(fit.coefficients[0] > fit.half_widths[0])


def _is_clipped(commands: Array) -> bool:
    """Whether many commands are the largest or the smallest one: clipped ones do not answer in proportion."""
    spread = float(np.ptp(commands))
    ends = (commands > commands.max() - _END * spread) | (commands < commands.min() + _END * spread)
    return float(np.mean(ends)) > _CLIPPED


def _advice(part: LogPart, before: bool) -> str:
    if part.comes_before == before:
        return "; is the column shifted?"
    return f"; try command_before_sample: {'true' if before else 'false'}"


def _rate(part: LogPart, angle: str, rate: str) -> Array:
    """A rate as measured, or the mean one since the row before, (n,)."""
    if rate in part.signals:
        return part.signals[rate]
    return np.diff(part.signals[angle], prepend=part.signals[angle][:1]) / part.period


def _partial(y: Array, x: Array, others: list[Array], period: float) -> tuple[Regression, float]:
    """Regression of y on x beside others, and the partial correlation of the two."""
    whole = regression(y, [x, *others], period)
    without = regression(y, others, period)
    left = 1.0 - without.explained
    share = (whole.explained - without.explained) / left if left > 0.0 else 0.0
    return whole, float(np.sign(whole.coefficients[0]) * np.sqrt(max(share, 0.0)))


def _evidence(part: LogPart, commands: Array, rate: Array, name: str = "command") -> Curves:
    n = min(len(commands), len(rate))
    scale = float(np.std(rate)) / (float(np.std(commands)) or 1.0)
    centred = (commands[:n] - commands.mean()) * scale
    return Curves(part.period, rate[:n] - rate.mean(), "tilt rate [rad/s]", centred, f"{name}, scaled to it [rad/s]")
