"""Left and right wheel: whether they are what the mapping says, by turning and by what each motor drives."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from twbal.core.block_regression import CREEP, Regression, regression
from twbal.core.gaussian import Array
from twbal.core.smoothed_derivatives import lengths, smoothed
from twbal.io.importers.checks.doubt import Curves, Doubt, DoubtKind, LogPart
from twbal.io.importers.checks.mechanics import mechanics
from twbal.io.importers.checks.rates import changes, integral, turned

SCALE_OF_EACH = "give each its scale: [s, -s] in the place of a scale s"
"""What to do where one of two columns has the wrong sign."""
_SPAN = 0.3  # s over which turns are taken
_TURNS = 0.5  # correlation of wheels and yaw from which its sign counts
_OFF = 3.0  # times by which turns may be larger or smaller than the wheels tell: tyres scrub, tracks are guesses
_OFFSET = 0.5  # rad/s that the yaw rate of a robot at rest may be off: gyros have up to 0.35, and noise
_FAST = 2.0  # rad/s, beyond which hardly any robot turns all the time
_MORE = 0.2  # of the wheels' acceleration by which their difference must tell more than their mean


def side_doubts(part: LogPart) -> Iterator[Doubt]:
    """Sentences on wheels that are mixed up."""
    sides = next((part.sides[name] for name in ("wheel_angle", "distance", "wheel_rate") if name in part.sides), None)
    if sides is None:
        yield from _fast_turns_of_one_wheel(part)
        return
    is_angle = "wheel_angle" in part.sides or "distance" in part.sides
    angles = sides if is_angle else (integral(sides[0], part.period), integral(sides[1], part.period))
    against = list(_against_each_other(part, angles))
    yield from against
    if against:
        return
    evidence = [found for found in (_by_yaw(part, sides, is_angle), _by_motors(part, sides, is_angle)) if found]
    yield from (each.doubt for each in evidence if each.sign < 0)
    sizes = [each.of_size for each in evidence if each.sign > 0 and each.of_size is not None]
    yield from sizes or (sizes := list(_turns_too_fast(part, sides, is_angle)))
    if evidence and not (sizes or any(each.sign for each in evidence)):
        sentence = (
            "which of its wheels is the left one: it hardly turns. Turn it on the spot for a while, and log the gyro's "
            "yaw rate"
        )
        yield Doubt(DoubtKind.UNTOLD, "wheel_angle", sentence)


class _SideEvidence(NamedTuple):
    """What tells left from right.

    Attributes:
        sign: 1 where the wheels are what the mapping says, -1 where they are swapped, 0 where it is not clear.
        doubt: what to say where they are swapped.
        of_size: what to say where they are not, and turns are of another size than they tell; None where they are not.
    """

    sign: int
    doubt: Doubt
    of_size: Doubt | None = None


def _against_each_other(part: LogPart, sides: tuple[Array, Array]) -> Iterator[Doubt]:
    """Whether the body answers the wheels' difference where it should answer their mean: one counts backward."""
    together, apart = (
        mechanics(part, wheels=0.5 * (sides[0] + sides[1])),
        mechanics(part, wheels=0.5 * (sides[1] - sides[0])),
    )
    if apart is None:
        return
    of_mean = together.motion.explained if together is not None else 0.0
    answered = abs(apart.motion.coefficients[1]) > apart.motion.half_widths[1]
    if answered and apart.motion.explained > of_mean + _MORE:
        sentence = (
            "left and right wheel count against each other: the body answers their difference and not their mean; "
            f"{SCALE_OF_EACH}"
        )
        demanded = apart.motion.fitted
        mean = np.zeros_like(demanded) if together is None else together.wheel_acceleration
        names = "mean of the wheels' accelerations [rad/s²]", "what the tilt demands of it [rad/s²]"
        evidence = Curves(part.period, mean, names[0], demanded, names[1])
        yield Doubt(DoubtKind.SIGN, "wheel_angle", sentence, evidence)


def _sign(fit: Regression) -> int:
    """Of the first coefficient; 0 where it is not clear, or tells little."""
    value, half = float(fit.coefficients[0]), float(fit.half_widths[0])
    return int(np.sign(value)) if abs(value) > half and fit.explained > _TURNS**2 else 0


def _by_yaw(part: LogPart, sides: tuple[Array, Array], is_angle: bool) -> _SideEvidence | None:
    """Whether the robot turns left while the right wheel runs ahead, as it must; None where nothing tells its turns."""
    span = max(1, round(_SPAN / part.period))
    if "yaw_rate" in part.signals:
        turns, name = turned(part.signals["yaw_rate"], span, part.period), "yaw_rate"
    elif "heading" in part.signals:
        turns, name = changes(np.unwrap(part.signals["heading"]), span), "heading"
    else:
        return None
    apart = sides[1] - sides[0]
    wheels = changes(apart, span) if is_angle else turned(apart, span, part.period)
    if np.ptp(turns) == 0.0 or np.ptp(wheels) == 0.0:
        return None
    fit = regression(turns, [wheels], part.period)
    sentence = (
        f"the robot turns right by its {name} while its right wheel runs ahead: are the wheels swapped (the left "
        f"one comes first), or has {name} the wrong sign?"
    )
    evidence = Curves(
        part.period, turns, f"turn by {name} [rad]", -fit.fitted, "turn by the wheels, scaled to it [rad]"
    )
    return _SideEvidence(
        _sign(fit), Doubt(DoubtKind.SIDES, "wheel_angle", sentence, evidence), _of_size(part, fit, turns, name)
    )


def _of_size(part: LogPart, fit: Regression, turns: Array, name: str) -> Doubt | None:
    """Turns that are far larger or smaller than the wheels, their radius and the track tell: of another unit."""
    if part.robot is None:
        return None
    size = abs(float(fit.coefficients[0])) * part.robot.track / part.robot.wheel_radius
    if 1.0 / _OFF < size < _OFF:
        return None
    sentence = (
        f"the robot turns {size:.2g} times as far by its {name} as its wheels and the data sheet's track tell: has "
        f"{name} another unit?"
    )
    evidence = Curves(part.period, turns, f"turn by {name} [rad]", fit.fitted, "turn by the wheels, scaled to it [rad]")
    return Doubt(DoubtKind.UNIT, name, sentence, evidence)


def _turns_too_fast(part: LogPart, sides: tuple[Array, Array], is_angle: bool) -> Iterator[Doubt]:
    """A sentence on a yaw rate far beyond what the wheels tell, also where the two do not go together.

    A robot that stands has little more than noise in its yaw rate, and noise in another unit is large, too.
    """
    if part.robot is None or "yaw_rate" not in part.signals:
        return
    span = max(1, round(_SPAN / part.period))
    by_gyro = turned(part.signals["yaw_rate"], span, part.period)
    apart = (sides[1] - sides[0]) * part.robot.wheel_radius / part.robot.track
    by_wheels = changes(apart, span) if is_angle else turned(apart, span, part.period)
    gyro, wheels = (_rms(values) / (span * part.period) for values in (by_gyro, by_wheels))
    if gyro < _OFFSET + _OFF * wheels:
        return
    sentence = (
        f"the robot turns at {gyro:.2g} rad/s by its yaw_rate, and at {wheels:.2g} rad/s by its wheels and the data "
        "sheet's track (root mean squares): has yaw_rate another unit, or an offset?"
    )
    evidence = Curves(part.period, by_gyro, "turn by yaw_rate [rad]", by_wheels, "turn by the wheels [rad]")
    yield Doubt(DoubtKind.UNIT, "yaw_rate", sentence, evidence)


def _fast_turns_of_one_wheel(part: LogPart) -> Iterator[Doubt]:
    """A note on a yaw rate that is large, and that one column of wheels cannot confirm."""
    rate = _rms(part.signals["yaw_rate"]) if "yaw_rate" in part.signals else 0.0
    if rate > _FAST:
        sentence = (
            f"whether its yaw_rate has the right unit: it is {rate:.2g} rad/s throughout (root mean square), which a "
            "robot seldom turns at. Log both wheels"
        )
        yield Doubt(DoubtKind.UNTOLD, "yaw_rate", sentence)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _by_motors(part: LogPart, sides: tuple[Array, Array], is_angle: bool) -> _SideEvidence | None:
    """Whether the right wheel speeds up where the right motor drives more; None without two motors that differ."""
    motors = next((part.sides[name] for name in ("command", "voltage") if name in part.sides), None)
    if motors is None:
        return None
    more = motors[1] - motors[0]
    if part.comes_before:
        more = np.append(more[1:], more[-1:])
    if np.ptp(more) == 0.0 or np.ptp(sides[1] - sides[0]) == 0.0:
        return None
    first = 1 if is_angle else 0
    fit, rolling, drive = max(
        (_driven(more, sides, first, part.period, length) for length in lengths(len(more), part.period)),
        key=lambda each: abs(float(each[0].coefficients[0] / each[0].half_widths[0])),
    )
    sentence = (
        "the right wheel slows down where the right motor drives more than the left one: are the wheels swapped, "
        "or the motors (the left one comes first)?"
    )
    evidence = Curves(
        part.period,
        rolling,
        "right less left wheel's acceleration [rad/s²]",
        drive * float(np.std(rolling) / (np.std(drive) or 1.0)),
        "right less left motor, scaled to it [rad/s²]",
    )
    return _SideEvidence(_sign(fit), Doubt(DoubtKind.SIDES, "wheel_angle", sentence, evidence))


def _driven(
    more: Array, sides: tuple[Array, Array], first: int, dt: float, length: float
) -> tuple[Regression, Array, Array]:
    """How the wheels' difference speeds up with that of the motors, through one kernel; and the two of them.

    Dry friction is taken off at each wheel: it does not oppose a turn while both roll forward.
    """
    drive, steeper = (smoothed(more, dt, length, order, 0.5 * dt) for order in (0, 1))
    left, right = (smoothed(values, dt, length, first) for values in sides)
    rolling = smoothed(sides[1] - sides[0], dt, length, first + 1)
    rubbed = np.tanh(right / CREEP) - np.tanh(left / CREEP)
    return regression(rolling, [drive, steeper, right - left, rubbed], dt), rolling, drive
