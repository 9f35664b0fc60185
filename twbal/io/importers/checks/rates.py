"""Measured rates against the angles that they belong to: sign, unit, column, row."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from twbal.core.block_regression import regression
from twbal.core.gaussian import Array
from twbal.core.smoothed_derivatives import noise_sd
from twbal.io.importers.checks.doubt import Curves, Doubt, DoubtKind, LogPart
from twbal.io.importers.checks.factors import OF_EDGES, guessed_reason, is_of_edges

PAIRS = {"tilt": "tilt_rate", "wheel_angle": "wheel_rate", "heading": "yaw_rate"}
"""Angles and their rates."""

_SPANS = (0.05, 0.1, 0.2, 0.4)  # s over which changes are taken; that of the highest correlation counts
_SCALE = 1.15  # factor by which gyros (3 %) and nominal loop times (5 %) may well be off
_FOLLOWS = 0.5  # of the change that a rate must tell at least, if it is of that angle
_CLEAR = 0.8  # share of an angle's changes that is no noise, from which they say something
_CLOSE = 0.9  # correlation of tilt and rate from which a lag between them can be told
_LATEST = 0.3  # s by which a tilt may come after its rate, and it is seen
_EXPLAINED = 0.5  # of what an angle and its rate differ by, below which a lag explains it
_NO_UNIT = 4.0  # factor below which no unit of a gyro is mistaken for another one: the least is 6
_ONE_SENSOR = 0.975  # correlation, noise apart, of an angle and a rate of one encoder, at least
_RELATED = 0.5  # correlation from which a rate that is off by a factor is of that angle at all
LATE_ROWS, LATE = 0.75, 0.005
"""Rows and s by which a tilt may well be late or early: filters that sum rates take half a row, those of IMUs 5 ms."""


class RateAgreement(NamedTuple):
    """How a rate and the changes of its angle go together.

    Attributes:
        angle: its quantity.
        rate: its quantity.
        factor: of the rate to the changes; the middle of what noise leaves open.
        low: least factor that noise leaves open.
        high: largest.
        slope: of the rate over the changes.
        half_width: of the slope's interval.
        correlation: from -1 to 1.
        clarity: share of the variance of the changes that is no noise.
        inverse: slope of the changes over the rate.
        inverse_half_width: of its interval.
        rate_clarity: share of the variance of what the rate turns through that is no noise.
        evidence: both, for a picture.
    """

    angle: str
    rate: str
    factor: float
    low: float
    high: float
    slope: float
    half_width: float
    correlation: float
    clarity: float
    inverse: float
    inverse_half_width: float
    rate_clarity: float
    evidence: Curves

    @property
    def has_wrong_sign(self) -> bool:
        """Whether one runs against the other."""
        return self.slope + self.half_width < 0.0 and self.correlation < -_RELATED

    @property
    def has_wrong_scale(self) -> bool:
        """Whether one is a multiple of the other."""
        return self.correlation > _RELATED and (self.low > _SCALE or self.high < 1.0 / _SCALE)

    @property
    def is_of_another_sensor(self) -> bool:
        """Whether wheels that move clearly, and a rate with another sign or size, are not of one encoder."""
        likeness = abs(self.correlation) / np.sqrt(max(self.clarity * self.rate_clarity, 1e-9))
        differs = self.has_wrong_sign or self.has_wrong_scale
        return bool(self.angle == "wheel_angle" and differs and likeness < _ONE_SENSOR)

    @property
    def is_of_edges(self) -> bool:
        """Whether wheels and their rate are off by the factor of an encoder's edges that count."""
        is_scale = self.angle == "wheel_angle" and self.has_wrong_scale and not self.is_of_another_sensor
        return is_scale and is_of_edges(self.factor)

    @property
    def agrees(self) -> bool:
        """Whether the two are the same motion in the same time."""
        return self.correlation > _RELATED and not self.has_wrong_scale

    @property
    def is_unrelated(self) -> bool:
        """Whether one of them moves and the other does not tell it."""
        if self.has_wrong_sign or self.has_wrong_scale:
            return False
        reproduced = self.slope + self.half_width > _FOLLOWS * self.clarity
        followed = self.inverse + self.inverse_half_width > _FOLLOWS * self.rate_clarity
        return (self.clarity > _CLEAR and not reproduced) or (self.rate_clarity > _CLEAR and not followed)


def agreements(part: LogPart) -> list[RateAgreement]:
    """All pairs of which both were measured, and the angle moved."""
    found = []
    for angle, rate in PAIRS.items():
        if (
            (angle in part.signals if angle != "tilt" else part.has_tilt)
            and rate in part.signals
            and np.ptp(part.signals[angle])
            and np.ptp(part.signals[rate])
        ):
            found.append(_agreement(part, angle, rate))
    return found


def _agreement(part: LogPart, angle: str, rate: str) -> RateAgreement:
    values, rates, dt = part.signals[angle], part.signals[rate], part.period
    values = np.unwrap(values) if angle == "heading" else values
    spans = sorted({max(1, round(span / dt)) for span in _SPANS if span / dt < len(values) / 8} or {1})
    pairs = {span: (changes(values, span), turned(rates, span, dt)) for span in spans}
    span = max(pairs, key=lambda s: abs(_correlation(*pairs[s])))
    span = span if abs(_correlation(*pairs[span])) > _RELATED else spans[-1]  # where noise matters least
    x, y = pairs[span]
    forward, backward = regression(y, [x], dt), regression(x, [y], dt)
    slope, inverse = float(forward.coefficients[0]), float(backward.coefficients[0])
    low = slope - float(forward.half_widths[0])
    most = inverse - float(backward.half_widths[0])
    return RateAgreement(
        angle,
        rate,
        float(np.sqrt(abs(slope / inverse))) if inverse else 0.0,
        low,
        1.0 / most if most > 0 else np.inf,
        slope,
        float(forward.half_widths[0]),
        float(np.sign(slope) * np.sqrt(forward.explained)),
        max(1.0 - 2.0 * noise_sd(values) ** 2 / float(np.var(x)), 0.0),
        inverse,
        float(backward.half_widths[0]),
        max(1.0 - span * (noise_sd(rates) * dt) ** 2 / float(np.var(y)), 0.0),
        Curves(dt, y - y.mean(), f"{rate} over {span * dt:.2g} s [rad]", x - x.mean(), f"change of {angle} [rad]"),
    )


def _correlation(x: Array, y: Array) -> float:
    return float(np.corrcoef(x, y)[0, 1]) if np.ptp(x) and np.ptp(y) else 0.0


def changes(values: Array, span: int) -> Array:
    """Changes over `span` samples, (n - span,)."""
    return values[span:] - values[:-span]


def integral(rates: Array, period: float) -> Array:
    """Angle that a rate turns through since the first sample, (n,)."""
    return np.concatenate([[0.0], np.cumsum(0.5 * period * (rates[1:] + rates[:-1]))])


def turned(rates: Array, span: int, period: float) -> Array:
    """Angles that rates turn through in `span` samples, (n - span,)."""
    return changes(integral(rates, period), span)


def rate_doubts(found: Sequence[RateAgreement], to_blame: Mapping[str, str]) -> Iterator[Doubt]:
    """Sentences on rates that their angles contradict.

    Args:
        found: `agreements` of a log.
        to_blame: which of a pair mechanics contradicts, by angle; "" or absent where that is not clear.
    """
    for pair in found:
        wrong = to_blame.get(pair.angle, "")
        which = f"{wrong}" if wrong else "one of them"
        if pair.is_of_another_sensor:
            sentence = (
                f"wheel_rate goes with the changes of wheel_angle only roughly (correlation {pair.correlation:.2f}), "
                "which one encoder does not: is one of them taken from another column?"
            )
            yield Doubt(DoubtKind.COLUMN, "wheel_rate", sentence, pair.evidence)
        elif pair.has_wrong_sign:
            sentence = f"{pair.rate} runs against {pair.angle}: {which} has the wrong sign"
            yield Doubt(DoubtKind.SIGN, wrong or pair.rate, sentence, pair.evidence)
        elif pair.has_wrong_scale and pair.angle == "tilt" and abs(np.log(pair.factor)) < np.log(_NO_UNIT):
            sentence = (
                f"tilt_rate is {pair.factor:.3g} times as fast as tilt changes, which no unit explains: is the rate or "
                "the unit of time wrong, or the scale of one of them?"
            )
            yield Doubt(DoubtKind.TIME, "time", sentence, pair.evidence)
        elif pair.is_of_edges:
            sentence = (
                f"wheel_rate is {pair.factor:.3g} times as fast as wheel_angle changes; {OF_EDGES}: is the scale off "
                "by that, or is the time base wrong?"
            )
            yield Doubt(DoubtKind.UNIT, wrong or pair.rate, sentence, pair.evidence)
        elif pair.has_wrong_scale:
            reason = guessed_reason(pair.factor)
            column = "" if reason else " or from another column"
            sentence = (
                f"{pair.rate} is {pair.factor:.3g} times as fast as {pair.angle} changes{reason}: is {which} in "
                f"another unit{column}, or is the time base wrong?"
            )
            yield Doubt(DoubtKind.UNIT, wrong or pair.rate, sentence, pair.evidence)
        elif pair.is_unrelated:
            sentence = (
                f"{pair.rate} does not follow {pair.angle} (correlation {pair.correlation:.2f}): is {which} taken "
                "from another column?"
            )
            yield Doubt(DoubtKind.COLUMN, wrong or pair.rate, sentence, pair.evidence)


def _whole_rows_late(change: Array, turn: Array, most: int) -> int:
    """Rows, up to `most`, by which an angle comes after its rate; 0 where that explains it hardly better than none."""
    found = [_correlation(change[rows:], turn[: len(turn) - rows]) for rows in range(most + 1)]
    best = int(np.argmax(found))
    return best if 1.0 - found[best] ** 2 < _EXPLAINED * (1.0 - found[0] ** 2) else 0


def lateness_doubts(part: LogPart, found: Sequence[RateAgreement]) -> Iterator[Doubt]:
    """A sentence on a tilt that comes after its rate: Δθ = x - late x', with the angle x that the rate turns through.

    One that comes before it is none: a complementary filter's tilt, which has the robot's acceleration in it, does.
    """
    for pair in found:
        if pair.angle != "tilt":
            continue
        dt = part.period
        span = max(1, round(_SPANS[1] / dt))
        change, turn = changes(part.signals["tilt"], span), turned(part.signals["tilt_rate"], span, dt)
        rows = _whole_rows_late(change, turn, min(round(_LATEST / dt), len(turn) // 8))
        change, turn = change[rows:], turn[: len(turn) - rows]
        if max(pair.correlation, _correlation(change, turn)) < _CLOSE:
            continue
        fit = regression(change, [turn, np.gradient(turn)], dt)  # for a row
        scale = float(fit.coefficients[0]) or 1.0
        late, half = rows - float(fit.coefficients[1]) / scale, abs(float(fit.half_widths[1]) / scale)
        if late - half > LATE_ROWS + LATE / dt:
            sentence = (
                f"tilt comes {late:.2g} rows ({1e3 * late * dt:.2g} ms) after tilt_rate: is one of them from another "
                "row, or filtered?"
            )
            yield Doubt(DoubtKind.ROW, "tilt", sentence, pair.evidence)
