"""What mechanics makes doubtful about tilt, wheels, command and time."""

from collections.abc import Iterator, Sequence
from math import log, sqrt

import numpy as np

from twbal.core.gaussian import Array
from twbal.io.importers.checks.doubt import Curves, Doubt, DoubtKind, LogPart
from twbal.io.importers.checks.factors import guessed_reason
from twbal.io.importers.checks.mechanics import Expected, Mechanics, expected
from twbal.io.importers.checks.rates import RateAgreement

_SHEET = 3.0  # factor by which what a data sheet makes of Q and d may well be off: loads, rotors, gears
_GRAVITY = 1.5  # factor by which time may seem off, as its square goes with G / Q
_NOTHING = 0.2  # of the effect that a command must have by the data sheet, below which it is none
_RUBBED = 50.0  # factor by which stiction may seem to take from a command's effect, as the regulator works against it
_UNKNOWN = 2.0  # of a command's effect: where its interval is wider, the log tells nothing of it
_AGAINST = 0.1  # of what a data sheet makes of Q, from which a negative one is more than a wrong unit
_EXPLAINED = 0.25  # share of the wheels' acceleration from which another unit is more likely than another column
_SAME = 1.3  # factor within which two tell the same
_BOTH = 1.25  # factor by which a rate and the fall must both be off, where neither alone is off enough to be said


def signs(found: Mechanics) -> tuple[int, int, int]:
    """Of Q, of b and of d: 1 as mechanics demands, -1 against it, 0 where noise leaves it open."""
    coupling = _sign(-float(found.motion.coefficients[1]), float(found.motion.half_widths[1]))
    body = _sign(-float(found.body.coefficients[0]), float(found.body.half_widths[0]))
    wheels = _sign(float(found.wheels.coefficients[0]), float(found.wheels.half_widths[0]))
    return coupling, body, wheels


def _sign(value: float, half_width: float) -> int:
    return 0 if abs(value) <= half_width else int(np.sign(value))


def motion_doubts(part: LogPart, found: Mechanics, pairs: Sequence[RateAgreement]) -> Iterator[Doubt]:
    """Sentences on what contradicts mechanics."""
    sign = list(_sign_doubts(part, found))
    yield from sign
    if sign or part.robot is None:
        return
    sheet = expected(part.robot)
    yield from _coupling_doubts(part, found, sheet, pairs)
    yield from _command_doubts(part, found, sheet, pairs)


def _sign_doubts(part: LogPart, found: Mechanics) -> Iterator[Doubt]:
    coupling, body, wheels = signs(found)
    if coupling < 0:
        evidence = _wheels_and_tilt(part, found, abs(float(found.motion.coefficients[1])))
        if body < 0 or (body == 0 and wheels > 0):
            sentence = "the tilt seems to have the wrong sign: the body must turn back while the wheels speed up"
            yield Doubt(DoubtKind.SIGN, "tilt", sentence, evidence)
        elif wheels < 0 or body > 0:
            sentence = "the wheels seem to have the wrong sign: they must speed up forward while the body turns back"
            yield Doubt(DoubtKind.SIGN, "wheel_angle", sentence, evidence)
        else:
            sentence = "tilt or wheels have the wrong sign: the body must turn back while the wheels speed up"
            yield Doubt(DoubtKind.SIGN, "tilt", sentence, evidence)
    elif (body < 0 and wheels <= 0) or (wheels < 0 and body <= 0):
        sentence = "the command seems to have the wrong sign: a positive one must drive the wheels forward"
        yield Doubt(DoubtKind.SIGN, "command", sentence, _command_and_wheels(part, found))


def _coupling_doubts(
    part: LogPart, found: Mechanics, sheet: Expected, pairs: Sequence[RateAgreement]
) -> Iterator[Doubt]:
    """Tilt and wheels in units of their own, or one of them from another column, or time."""
    name = part.robot.name if part.robot else ""
    coupling, half = -float(found.motion.coefficients[1]), float(found.motion.half_widths[1])
    evidence = _wheels_and_tilt(part, found, sheet.coupling)
    ratio = coupling / sheet.coupling
    low, high = (coupling - half) / sheet.coupling, (coupling + half) / sheet.coupling
    if high < 1.0 / _SHEET and found.motion.explained < _EXPLAINED:
        sentence = (
            "wheels and tilt do not move together as they must on any robot: is one of them from another column, or "
            "do the two wheels count against each other?"
        )
        yield Doubt(DoubtKind.COLUMN, _blamed(pairs), sentence, evidence)
    elif high < 1.0 / _SHEET and ratio < -_AGAINST:
        sentence = "wheels and tilt seem to move against mechanics: has one of them the wrong sign?"
        yield Doubt(DoubtKind.SIGN, _blamed(pairs), sentence, evidence)
    elif high < 1.0 / _SHEET or low > _SHEET:
        if _is_of_edges(ratio, pairs):
            return
        sentence = (
            f"the wheels answer the tilt {ratio:.3g} times as strongly as the data sheet of {name} says"
            f"{guessed_reason(ratio, log(_SHEET), is_of_wheels=True)}: is the unit of tilt or wheels "
            "wrong, or the data sheet?"
        )
        yield Doubt(DoubtKind.UNIT, _blamed(pairs), sentence, evidence)
    elif not any(pair.agrees for pair in pairs):
        factor, within = time_factor(found, sheet)
        if factor / within > _GRAVITY or factor * within < 1.0 / _GRAVITY:
            sentence = (
                f"the robot falls as if time ran {factor:.2g} times too slow in this log: is the rate or the unit of "
                f"time wrong, or the data sheet of {name}?"
            )
            yield Doubt(DoubtKind.TIME, "time", sentence, evidence)


def _is_of_edges(ratio: float, pairs: Sequence[RateAgreement]) -> bool:
    """Whether a scale of the encoders that their rate contradicts, which is said there, explains wheels so strong."""
    return any(pair.is_of_edges and 1.0 / _SHEET < ratio * pair.factor < _SHEET for pair in pairs)


def time_factor(found: Mechanics, sheet: Expected) -> tuple[float, float]:
    """How many times too long the stated period is, as G / Q goes with its square; and the factor of its interval."""
    (gravity, minus), (wide, half) = found.motion.coefficients[:2], found.motion.half_widths[:2]
    coupling = -float(minus)
    if gravity <= wide or coupling <= half:
        return 1.0, np.inf
    share = float(gravity) / coupling * sheet.coupling / sheet.gravity
    relative = sqrt(float(wide / gravity) ** 2 + (float(half) / coupling) ** 2)
    return 1.0 / sqrt(share), float(np.exp(0.5 * relative))


def _blamed(pairs: Sequence[RateAgreement]) -> str:
    """Which of tilt and wheels is the more likely: that whose rate does not agree with it."""
    good = {pair.angle for pair in pairs if not (pair.is_unrelated or pair.has_wrong_scale or pair.has_wrong_sign)}
    return "tilt" if "wheel_angle" in good and "tilt" not in good else "wheel_angle" if "tilt" in good else ""


def _command_doubts(
    part: LogPart, found: Mechanics, sheet: Expected, pairs: Sequence[RateAgreement]
) -> Iterator[Doubt]:
    """A command that does much more or much less than its torque can."""
    name = part.robot.name if part.robot else ""
    effects = [
        (float(fit.coefficients[0]) / size, float(fit.half_widths[0]) / abs(size), fit)
        for fit, size in ((found.body, -sheet.turned), (found.wheels, sheet.driven))
    ]
    value, half, fit = min(effects, key=lambda each: each[1] / max(abs(each[0]), _NOTHING))
    evidence = _command_and_wheels(part, found)
    if value + half < 1.0 / _RUBBED and fit.explained < _EXPLAINED:
        sentence = "the robot does not answer the command: is the command from another column?"
        yield Doubt(DoubtKind.COLUMN, "command", sentence, evidence)
    elif value < -_NOTHING and value + half < _NOTHING:
        sentence = (
            "the command seems to have the wrong sign, or is another column: a positive one must drive the wheels "
            "forward"
        )
        yield Doubt(DoubtKind.SIGN, "command", sentence, evidence)
    elif value + half < 1.0 / _RUBBED and value <= half:
        sentence = (
            "the accelerations in this log do not show the command: friction or back-EMF takes nearly all of it, as in "
            "geared motors, or is the command another column?"
        )
        yield Doubt(DoubtKind.COLUMN, "command", sentence, evidence)
    elif value + half < 1.0 / _RUBBED or value - half > _SHEET:
        if fit is found.wheels and _is_of_edges(value, pairs):
            return
        sentence = (
            f"the robot answers the command {value:.3g} times as strongly as the data sheet of {name} says"
            f"{guessed_reason(max(value, 1e-12), log(_SHEET)) if value > 0 else ''}: is its unit or scale wrong, or is "
            "it another column?"
        )
        yield Doubt(DoubtKind.UNIT, "command", sentence, evidence)
    elif half > _UNKNOWN * max(abs(value), 1.0):
        sentence = (
            "what the command does cannot be estimated from this log: it hardly varies but as tilt and wheels do. "
            "Drive with more excitation, such as a reference that moves or noise on the command"
        )
        yield Doubt(DoubtKind.UNINFORMATIVE, "command", sentence, evidence)


def time_doubts(pairs: Sequence[RateAgreement], found: Mechanics, sheet: Expected | None) -> Iterator[Doubt]:
    """Where two rates are off by one factor, or one and the fall of the robot, it is time that is wrong.

    Args:
        pairs: of rates and angles.
        found: by mechanics.
        sheet: of the robot; None where there is none to compare with.
    """
    pairs = [pair for pair in pairs if pair.angle != "heading"]
    off = [pair for pair in pairs if pair.has_wrong_scale]
    if len(off) > 1 and max(abs(log(a.factor / b.factor)) for a in off for b in off) < log(_SAME):
        factor, evidence = float(np.exp(np.mean([log(pair.factor) for pair in off]))), off[0].evidence
    elif sheet is not None and (pair := _off_as_the_fall(found, sheet, pairs, off)):
        factor, evidence = pair.factor, pair.evidence
    else:
        return
    sentence = (
        f"time runs {factor:.3g} times too slow in this log: every rate is that much faster than its angle changes. Is "
        "the rate or the unit of time wrong?"
    )
    yield Doubt(DoubtKind.TIME, "time", sentence, evidence)


def _off_as_the_fall(
    found: Mechanics, sheet: Expected, pairs: Sequence[RateAgreement], off: Sequence[RateAgreement]
) -> RateAgreement | None:
    """A pair that is off as the robot's fall is; of those that are off by themselves (`off`), it must be the only one.

    None where there is none.
    """
    if off:
        return off[0] if len(off) == 1 and _falls_so(found, sheet, off[0].factor) else None
    return next((pair for pair in pairs if pair.agrees and _both_off(found, sheet, pair)), None)


def _falls_so(found: Mechanics, sheet: Expected, factor: float) -> bool:
    """Whether the robot falls as with a period that is `factor` times too long, rather than as with the stated one."""
    fall, within = time_factor(found, sheet)
    return abs(log(fall / factor)) < abs(log(fall)) and log(within) < abs(log(factor))


def _both_off(found: Mechanics, sheet: Expected, pair: RateAgreement) -> bool:
    """Whether a rate and the fall are both off by `_BOTH`, and by about the same factor."""
    fall, within = time_factor(found, sheet)
    is_clear = abs(log(pair.factor)) > log(_BOTH) and abs(log(fall)) - log(within) > log(_BOTH)
    return is_clear and abs(log(fall / pair.factor)) < log(_SAME)


def _wheels_and_tilt(part: LogPart, found: Mechanics, coupling: float) -> Curves:
    """The wheels' acceleration, and what the tilt says that it must be."""
    needed = -coupling * found.tilt_acceleration
    return Curves(
        part.period, found.wheel_acceleration, "wheels' acceleration [rad/s²]", needed, "what the tilt demands [rad/s²]"
    )


def _command_and_wheels(part: LogPart, found: Mechanics) -> Curves:
    wheels = found.wheel_acceleration - found.wheel_acceleration.mean()
    torque = found.torque - found.torque.mean()
    spread = float(np.std(torque)) or 1.0
    scaled: Array = torque * float(np.std(wheels)) / spread
    return Curves(part.period, wheels, "wheels' acceleration [rad/s²]", scaled, "command, scaled to it [rad/s²]")
