"""What is asked of a fitted set of effects: that it is worth its penalty, and of a sound kind."""

from collections.abc import Sequence

from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.data_sheet import DATA_SHEET
from twbal.diagnosis.hypothesis import FittedHypothesis
from twbal.diagnosis.record import Shift
from twbal.diagnosis.settings import Settings

_INSTANTS = (
    2000  # for which the limit of the autocorrelation is set; that of autocorrelated errors grows with their number
)


def passes(hypothesis: FittedHypothesis, base: FittedHypothesis, settings: Settings) -> bool:
    """Whether the data ask for what one set has beyond another, the last of its candidates.

    Autocorrelated errors gain too much by chance, so a gain counts over the autocorrelation that is left; but over no
    more than that at which nothing is named anyway, as another effect may still take it away. What is negligible is not
    named, however sure it is: it stands for some trifle of the robot's form.
    """
    lines = settings.lines
    gain = (base.bic - hypothesis.bic) / min(hypothesis.autocorrelation, lines.whiteness)
    return gain >= threshold(hypothesis.candidates[-1], settings) and hypothesis.size >= lines.least


def threshold(candidate: Candidate, settings: Settings) -> float:
    """Gain over the autocorrelation that is left, from which on a candidate is worth its penalty."""
    return settings.lines.sheet if candidate.in_data_sheet else settings.lines.score


def adds_enough(
    hypothesis: FittedHypothesis, base: FittedHypothesis, first: FittedHypothesis, settings: Settings
) -> bool:
    """Whether another effect gains enough beside what the others gained to be an effect of its own.

    Where the form of a named effect is not quite the robot's, what is left asks for more effects, each for little.

    Args:
        hypothesis: the set with the other effect.
        base: the set without it.
        first: the data sheet refitted.
        settings: of the diagnosis.
    """
    gain = base.bic - hypothesis.bic
    return not base.effects or gain >= settings.lines.share * (first.bic - base.bic)


def is_sound(hypothesis: FittedHypothesis, base: FittedHypothesis, settings: Settings) -> bool:
    """Whether a set is worth its penalty beside the refitted data sheet, with nothing negligible or at a bound."""
    negligible = any(hypothesis.size_of(candidate) < settings.lines.least for candidate in hypothesis.candidates)
    return passes(hypothesis, base, settings) and not negligible and not hypothesis.at_bound


def best_inside(passing: Sequence[FittedHypothesis], before: FittedHypothesis, settings: Settings) -> FittedHypothesis:
    """The best set; or one with all parameters inside their ranges, where that explains nearly as much.

    One that swallows the commands explains anything; it is the best only where there is no other.
    """
    passing = [w for w in passing if not w.overriding] or passing
    best = passing[0]
    handicap = max(3.0 * settings.lines.score * best.autocorrelation, settings.lines.share * (before.bic - best.bic))
    found = [w for w in passing if not w.at_bound and w.bic < best.bic + handicap]
    return found[0] if found else best


def autocorrelation_limit(instants: int, settings: Settings) -> float:
    """Autocorrelation of residuals at so many instants from which on something is left that nothing explains."""
    return 1.0 + (settings.lines.whiteness - 1.0) * max(instants / _INSTANTS, 1.0)


def shifts_of(hypothesis: FittedHypothesis, settings: Settings) -> tuple[Shift, ...]:
    """How far the data pull the values of the data sheet, the largest first."""
    found = []
    for free in hypothesis.fit.frees:
        if free.field in DATA_SHEET:
            factor = hypothesis.fit.model.value(free.field) / free.mean
            sigmas = (factor - 1.0) / settings.tolerances.of(free.field)
            found.append(Shift(free.effect, DATA_SHEET[free.field].group, factor, sigmas))
    return tuple(sorted(found, key=lambda shift: -abs(shift.sigmas)))


def is_doubtful(hypothesis: FittedHypothesis, settings: Settings) -> bool:
    """Whether a set leaves something unexplained, so that it is no finding and another may be better.

    Its errors stay autocorrelated, a parameter is at a bound, or the data sheet is far out of its tolerances.
    """
    limit = autocorrelation_limit(len(hypothesis.fit.white) // 4, settings)
    far = any(
        abs(shift.sigmas) > settings.lines.beyond and shift.name not in hypothesis.names
        for shift in shifts_of(hypothesis, settings)
    )
    return hypothesis.autocorrelation > limit or bool(hypothesis.at_bound) or far
