"""All checks of one log, one after another."""

from collections.abc import Iterator, Mapping, Sequence

from twbal.core.gaussian import Array
from twbal.io.importers.checks.command_rows import command_row_doubts
from twbal.io.importers.checks.doubt import Curves, Doubt, DoubtKind, LogPart
from twbal.io.importers.checks.frozen import frozen_doubts
from twbal.io.importers.checks.implausible_values import (
    constant_doubts,
    lying_part_doubts,
    one_way_doubts,
    period_doubts,
    smooth_command_doubts,
    tilt_doubts,
    torque_doubts,
)
from twbal.io.importers.checks.jumps import without_jumps
from twbal.io.importers.checks.mechanics import Mechanics, expected, mechanics
from twbal.io.importers.checks.motion_doubts import motion_doubts, signs, time_doubts
from twbal.io.importers.checks.rates import (
    LATE,
    LATE_ROWS,
    RateAgreement,
    agreements,
    lateness_doubts,
    rate_doubts,
)
from twbal.io.importers.checks.repeated_rows import repeat_doubts
from twbal.io.importers.checks.sensor_rows import is_differenced, tilt_row_doubts, wheel_row_doubts
from twbal.io.importers.checks.wheel_sides import side_doubts

_CLOSE = 0.95  # share of the wheels' acceleration that the tilt must explain for a lag to be told
_EARLY_ROWS, _EARLY = 0.3, 0.001  # rows and s by which wheels may well be read later than the gyro
_DIFFERENCED = 0.5  # rows by which a rate comes later than the angle that it is differenced from
_TOLD = 0.5  # rows within which the lag must be known, so that a row would be seen
_SHORTEST = 2.0  # s of motion, below which mechanics is not asked


def doubts(signals: Mapping[str, Array], part: LogPart) -> Iterator[Doubt]:
    """What a person should look at before anything is fitted to a log.

    Args:
        signals: of the whole log, as mapped.
        part: its longest part without a gap.
    """
    yield from constant_doubts(signals, part.sides)
    yield from period_doubts(part)
    yield from repeat_doubts(part)
    yield from frozen_doubts(part)
    jumps, part = without_jumps(part)  # which would hide, or seem to be, what other checks look for
    yield from jumps
    tilt = list(tilt_doubts(part))
    yield from tilt
    if tilt:
        return
    of_motion = list(_of_motion(part))
    if not any(doubt.kind is DoubtKind.UNIT and doubt.quantity in ("tilt", "tilt_rate") for doubt in of_motion):
        yield from lying_part_doubts(part)  # in degrees, a small tilt looks like that of one that lies
    one_way = list(one_way_doubts(part))
    yield from one_way
    yield from torque_doubts(part)
    yield from (doubt for doubt in of_motion if not (one_way and doubt.quantity == "command"))


def _of_motion(part: LogPart) -> Iterator[Doubt]:
    """What rates and mechanics contradict."""
    pairs = agreements(part)
    seen = [mechanics(part, by_gyro) for by_gyro in (True, False)] if _is_long(part) else [None, None]
    by_gyro, by_tilt = seen
    if by_gyro is None or by_tilt is None:
        yield from rate_doubts(pairs, {})
        return
    if "tilt_rate" in part.signals:  # what the wheels confirm of it is no noise
        pairs = [
            pair._replace(rate_clarity=max(pair.rate_clarity, by_gyro.motion.explained))
            if pair.angle == "tilt"
            else pair
            for pair in pairs
        ]
    differ = any(pair.angle == "tilt" and (pair.has_wrong_sign or pair.is_unrelated) for pair in pairs)
    blamed = _to_blame(by_gyro, by_tilt) if differ and "tilt_rate" in part.signals else ""
    found = by_tilt if blamed == "tilt_rate" else by_gyro
    is_of_edges = any(pair.is_of_edges for pair in pairs)  # by which turns of the wheels are off, too
    of_sides = [doubt for doubt in side_doubts(part) if not (is_of_edges and doubt.kind is DoubtKind.UNIT)]
    yield from of_sides
    sides = [doubt for doubt in of_sides if doubt.kind is not DoubtKind.UNTOLD]
    motion = [] if any(doubt.kind is DoubtKind.SIGN for doubt in sides) else list(motion_doubts(part, found, pairs))
    smooth = list(smooth_command_doubts(part)) if signs(found)[1:] == (0, 0) else []
    if smooth:
        motion = [doubt for doubt in motion if doubt.quantity != "command"]
    yield from smooth
    time = list(time_doubts(pairs, found, expected(part.robot) if part.robot else None))
    rates = list(rate_doubts(pairs, {"tilt": blamed}))
    yield from time
    yield from (doubt for doubt in rates if not (time and doubt.kind is DoubtKind.UNIT))
    yield from (doubt for doubt in motion if not (time and doubt.kind in (DoubtKind.TIME, DoubtKind.UNIT)))
    if not (time or rates or motion or sides or smooth):
        yield from _row_doubts(part, pairs, found, by_gyro is found)
    if not (time or any(doubt.kind is DoubtKind.TIME for doubt in motion) or any(map(_needs_no_note, pairs))):
        advice = "Log the gyro's" if part.has_tilt else "Log a tilt, too"
        sentence = (
            "whether its time is right to better than a factor of two: it has no rate that is measured apart from its "
            f"angle. {advice}"
        )
        yield Doubt(DoubtKind.UNTOLD, "time", sentence)


def _needs_no_note(pair: RateAgreement) -> bool:
    """Whether a rate and its angle agree about time, or are said not to go together, as a gyro and the tilt are."""
    is_of_gyro = pair.angle == "tilt" and (pair.has_wrong_scale or pair.is_unrelated)
    return pair.agrees or pair.has_wrong_sign or is_of_gyro


def _row_doubts(part: LogPart, pairs: Sequence[RateAgreement], found: Mechanics, is_by_gyro: bool) -> Iterator[Doubt]:
    """Sentences on columns of another row, and on what of it the log does not tell."""
    tilt = [*lateness_doubts(part, pairs)] or [*tilt_row_doubts(part)]
    wheels = [*wheel_row_doubts(part)]
    lags = [] if wheels else [*_lag_doubts(part, found, is_by_gyro and "tilt_rate" in part.signals)]
    said = [doubt for doubt in (*tilt, *wheels, *lags) if doubt.kind is not DoubtKind.UNTOLD]
    yield from said
    rows = [*command_row_doubts(part)]
    yield from rows
    if said or any(doubt.kind is DoubtKind.ROW for doubt in rows):
        return
    yield from (doubt for doubt in tilt if doubt.kind is DoubtKind.UNTOLD)
    if not is_differenced(part) and not _tells_lag(found, is_by_gyro and "tilt_rate" in part.signals):
        sentence = (
            "whether the wheels are of their row: log their rate as it is differenced from the counts, and the gyro's"
        )
        yield Doubt(DoubtKind.UNTOLD, "wheel_angle", sentence)


def _tells_lag(found: Mechanics, is_by_gyro: bool) -> bool:
    """Whether a row between tilt and wheels would be seen."""
    return is_by_gyro and found.motion.explained > _CLOSE and found.lag[1] < _TOLD


def _is_long(part: LogPart) -> bool:
    return len(part.commands) * part.period >= _SHORTEST


def _to_blame(by_gyro: Mechanics, by_tilt: Mechanics) -> str:
    """Which of tilt and its rate mechanics contradicts, where the two contradict each other; "" where both may be."""
    found_signs = signs(by_tilt)[0], signs(by_gyro)[0]
    return {(1, -1): "tilt_rate", (1, 0): "tilt_rate", (-1, 1): "tilt", (0, 1): "tilt"}.get(found_signs, "")


def _lag_doubts(part: LogPart, found: Mechanics, is_by_gyro: bool) -> Iterator[Doubt]:
    """A sentence on a tilt that comes late behind the wheels, or before them.

    Filters make a gyro late, and nothing makes it early. A filtered tilt, where there is no gyro, may well be early.
    Where there is no angle of the wheels, their rate may be differenced from one.
    """
    lag, half = found.lag
    early = _EARLY_ROWS + _EARLY / part.period + (0.0 if "wheel_angle" in part.signals else _DIFFERENCED)
    before = is_by_gyro and lag + half < -early
    if found.motion.explained > _CLOSE and (before or abs(lag) - half > LATE_ROWS + LATE / part.period):
        last, first = ("tilt", "the wheels") if lag > 0 else ("the wheels", "tilt")
        sentence = (
            f"{last} comes {abs(lag):.2g} rows ({1e3 * abs(lag) * part.period:.2g} ms) after {first}: is one of them "
            "from another row, or filtered?"
        ).replace("the wheels comes", "what the wheels do comes")
        evidence = Curves(
            part.period,
            found.wheel_acceleration,
            "wheels' acceleration [rad/s²]",
            found.motion.fitted,
            "what the tilt demands [rad/s²]",
        )
        yield Doubt(DoubtKind.ROW, "tilt" if lag > 0 else "wheel_angle", sentence, evidence)
