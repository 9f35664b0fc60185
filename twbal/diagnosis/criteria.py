"""When an effect is worth its penalty, and which of several sets of effects is the best."""

from collections.abc import Sequence

from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.hypothesis import FittedHypothesis, Round
from twbal.diagnosis.settings import Settings


def at_once_wins(
    at_once: FittedHypothesis, chosen: FittedHypothesis, base: FittedHypothesis, settings: Settings
) -> bool:
    """Whether effects that were fitted at once take the place of those that were found one by one."""
    if not at_once.candidates or not passes(at_once, base, settings):
        return False
    if at_once.overriding and chosen.candidates and not chosen.overriding:
        return False
    margin = settings.lines.score * min(at_once.autocorrelation, settings.lines.whiteness)
    return at_once.bic < chosen.bic + margin or bool(chosen.at_bound and not at_once.at_bound)


def substitutes(
    candidate: Candidate, chosen: FittedHypothesis, rounds: Sequence[Round], settings: Settings
) -> list[str]:
    """Effects that explain the data nearly as well in the place of one of a set."""
    found: list[str] = []
    rest = {name for name in chosen.names if name != candidate.name}
    for w in (w for step in rounds for w in step.hypotheses):
        others = set(w.names) - rest
        swapped = len(w.names) == len(chosen.names) and len(others) == 1 and candidate.name not in others
        if swapped and (w.bic - chosen.bic) / chosen.autocorrelation < settings.lines.margin:
            found.extend(others)
    return found


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
