"""Which effects to name: forward selection, one effect after the other, as long as the data ask for more."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.hypothesis import ALIKE, FittedHypothesis, Round, add_one, fit_hypothesis
from twbal.diagnosis.score_test import score_candidates
from twbal.diagnosis.settings import Settings
from twbal.sysid.model import Data, Free, Model

_BASE_ROUNDS, _LIGHTER_ROUNDS, _AT_ONCE_ROUNDS = 8, 3, 12
_BEGIN = 0.3  # share of their start values at which several effects begin at once
_MANY = 3  # effects of other kinds that do as well in the place of one, from which on it is not named beside another


class Selection(NamedTuple):
    """How the selection went.

    Attributes:
        base: the data sheet refitted.
        rounds: what was fitted, round by round.
        chosen: the set that it ended with; `base` where nothing is worth its penalty.
    """

    base: FittedHypothesis
    rounds: tuple[Round, ...]
    chosen: FittedHypothesis

    @property
    def sets(self) -> tuple[FittedHypothesis, ...]:
        """The best fit of every set of effects that was fitted."""
        best: dict[tuple[str, ...], FittedHypothesis] = {}
        for w in (self.base, self.chosen, *(w for step in self.rounds for w in (step.base, *step.hypotheses))):
            if w.names not in best or w.bic < best[w.names].bic:
                best[w.names] = w
        return tuple(best.values())


def select(
    data: Data,
    model: Model,
    always: Sequence[Free],
    candidates: Sequence[Candidate],
    settings: Settings,
    progress: Callable[[str], None] = lambda line: None,
) -> Selection:
    """Add effects to the data sheet as long as they are worth their penalty.

    One that was chosen while another was missing may be the wrong one. So with two effects each is reconsidered with
    the other in place, and of more those go again that are not worth their penalty beside the others.

    Args:
        data: recordings.
        model: where fits begin.
        always: what is always free.
        candidates: all that may be named.
        settings: of the diagnosis.
        progress: is told what is being done, a line at a time.
    """
    progress("refitting the nominal parameters")
    base = fit_hypothesis(data, data.with_noise(model, 30), always, (), _BASE_ROUNDS)
    rounds: list[Round] = []
    chosen = base
    while len(chosen.effects) < settings.most_effects and len(chosen.candidates) <= settings.most_effects:
        progress(f"weighing what to add to {', '.join(chosen.names) or 'the refit'}")
        step = add_one(data, chosen, always, _beside(chosen, candidates), settings.shortlist)
        rounds.append(step)
        passing = [w for w in step.hypotheses if passes(w, chosen, settings) and adds_enough(w, chosen, base, settings)]
        if not passing:
            break
        chosen = _inside(passing, chosen, settings)
    if not rounds:  # what the recordings could show is asked of the first round
        rounds.append(Round(base, score_candidates(data, base.fit, candidates), []))
    usual = [candidate for candidate in candidates if candidate.name in settings.usual]
    if usual and settings.most_effects:
        progress(f"fitting the {len(usual)} usual effects at once, and fewer of them")
        begin = data.with_noise(model, 30)
        at_once = without_redundant(data, _all_at_once(data, begin, always, usual), base, always, settings, begin)
        if _wins(at_once, chosen, base, settings):
            progress(f"weighing what to add to {', '.join(at_once.names)}")
            rounds.append(add_one(data, at_once, always, _beside(at_once, candidates), settings.shortlist))
            passing = [
                w for w in rounds[-1].hypotheses if passes(w, at_once, settings) and _is_sound(w, base, settings)
            ]
            chosen = passing[0] if passing and len(at_once.effects) < settings.most_effects else at_once
            progress("trying others in the place of each effect")
            rounds.append(_swap(data, chosen, begin, always, candidates, settings))
            # equivalents differ by rounding alone, which must not decide
            ahead = [w for w in rounds[-1].hypotheses if w.bic < chosen.bic - ALIKE]
            better = [w for w in ahead if _is_sound(w, base, settings)]
            return Selection(base, tuple(rounds), better[0] if better else chosen)
    if len(chosen.effects) > 2:
        chosen = without_redundant(data, chosen, base, always, settings)
    elif len(chosen.effects) > 1:
        progress(f"reconsidering {chosen.names[0]} beside the others")
        step = _reconsider(data, chosen, always, candidates, settings)
        rounds.append(step)
        chosen = _inside(sorted([chosen, *step.hypotheses], key=lambda w: w.bic), base, settings)
        chosen = without_unspecific(
            data, without_redundant(data, chosen, base, always, settings), always, rounds, settings
        )
    return Selection(base, tuple(rounds), chosen)


def _wins(at_once: FittedHypothesis, chosen: FittedHypothesis, base: FittedHypothesis, settings: Settings) -> bool:
    """Whether effects that were fitted at once take the place of those that were found one by one."""
    if not at_once.candidates or not passes(at_once, base, settings):
        return False
    if at_once.overriding and chosen.candidates and not chosen.overriding:
        return False
    margin = settings.lines.score * min(at_once.autocorrelation, settings.lines.whiteness)
    return at_once.bic < chosen.bic + margin or bool(chosen.at_bound and not at_once.at_bound)


def _is_sound(hypothesis: FittedHypothesis, base: FittedHypothesis, settings: Settings) -> bool:
    """Whether a set is worth its penalty beside the refitted data sheet, with nothing negligible or at a bound."""
    negligible = any(hypothesis.size_of(candidate) < settings.lines.least for candidate in hypothesis.candidates)
    return passes(hypothesis, base, settings) and not negligible and not hypothesis.at_bound


def _inside(passing: Sequence[FittedHypothesis], before: FittedHypothesis, settings: Settings) -> FittedHypothesis:
    """The best set; or one with all parameters inside their ranges, where that explains nearly as much.

    One that swallows the commands explains anything; it is the best only where there is no other.
    """
    passing = [w for w in passing if not w.overriding] or passing
    best = passing[0]
    handicap = max(3.0 * settings.lines.score * best.autocorrelation, settings.lines.share * (before.bic - best.bic))
    inside = [w for w in passing if not w.at_bound and w.bic < best.bic + handicap]
    return inside[0] if inside else best


def _beside(chosen: FittedHypothesis, candidates: Sequence[Candidate]) -> list[Candidate]:
    """Candidates that a set does not hold."""
    return [c for c in candidates if c.name not in chosen.names]


def _reconsider(
    data: Data, chosen: FittedHypothesis, always: Sequence[Free], candidates: Sequence[Candidate], settings: Settings
) -> Round:
    """Fit what could stand in the place of the effect that was chosen first."""
    first, *rest = chosen.candidates
    without = chosen.fit.model.put(first.none)
    base = fit_hypothesis(data, without, always, rest, _BASE_ROUNDS)
    left = [c for c in _beside(base, candidates) if c.name != first.name]
    return add_one(data, base, always, left, max(settings.shortlist // 2, 1))


def _all_at_once(data: Data, model: Model, always: Sequence[Free], candidates: Sequence[Candidate]) -> FittedHypothesis:
    """Several effects from a data sheet that is still as it was.

    One by one, the first has to do the work of all the others, and pulls the data sheet away to where the next is not
    found any more.
    """
    small = {
        candidate.field(p): p.none + _BEGIN * (p.start - p.none)
        for candidate in candidates
        for p in candidate.parameters
    }
    return fit_hypothesis(data, data.with_noise(model.put(small), 30), always, candidates, _AT_ONCE_ROUNDS)


def _swap(
    data: Data,
    chosen: FittedHypothesis,
    begin: Model,
    always: Sequence[Free],
    candidates: Sequence[Candidate],
    settings: Settings,
) -> Round:
    """Fit in each effect's place those that most robots have and those that are hard to tell from it."""
    found = []
    for out in chosen.effects:
        rest = [candidate for candidate in chosen.candidates if candidate is not out]
        for candidate in _beside(chosen, candidates):
            if candidate.name in settings.usual or candidate.name in out.hard_to_tell_from:
                found.append(_all_at_once(data, begin, always, [*rest, candidate]))
    return Round(chosen, [], sorted(found, key=lambda w: w.bic))


def without_redundant(
    data: Data,
    chosen: FittedHypothesis,
    base: FittedHypothesis,
    always: Sequence[Free],
    settings: Settings,
    begin: Model | None = None,
) -> FittedHypothesis:
    """Take off one candidate after the other: those of no use, negligible ones, and more than may be named.

    Of no use is one that gains less than a named one must.

    Args:
        data: recordings.
        chosen: the set.
        base: the data sheet refitted, which is left where none is of use.
        always: what is always free.
        settings: of the diagnosis.
        begin: a data sheet as it was, from which what is left is fitted too: the way from the larger set may be barred.
    """
    lines = settings.lines
    while chosen.candidates:
        autocorrelation = min(chosen.autocorrelation, lines.whiteness)
        too_many = len(chosen.effects) > settings.most_effects
        redundant = []
        for candidate in chosen.candidates:
            lighter = _one_less(data, chosen, candidate, base, always, begin)
            useless = (lighter.bic - chosen.bic) / autocorrelation < _threshold(candidate, settings)
            if useless or too_many or chosen.size_of(candidate) < lines.least:
                redundant.append(lighter)
        if not redundant:
            break
        chosen = min(redundant, key=lambda w: w.bic)
    return chosen


def _one_less(
    data: Data,
    chosen: FittedHypothesis,
    candidate: Candidate,
    base: FittedHypothesis,
    always: Sequence[Free],
    begin: Model | None,
) -> FittedHypothesis:
    """The better fit of a set without one of its candidates; arguments as of `without_redundant`."""
    rest = [other for other in chosen.candidates if other is not candidate]
    if not rest:
        return base
    without = chosen.fit.model.put(candidate.none)
    lighter = fit_hypothesis(data, without, always, rest, _LIGHTER_ROUNDS)
    if begin is None:
        return lighter
    return min(lighter, _all_at_once(data, begin, always, rest), key=lambda w: w.bic)


def without_unspecific(
    data: Data, chosen: FittedHypothesis, always: Sequence[Free], rounds: Sequence[Round], settings: Settings
) -> FittedHypothesis:
    """Of two effects, take off the later in whose place many others do as well.

    Where the robot's form of an effect is not quite ours, what is left asks for more, and gladly takes anything.
    """
    for candidate in reversed(chosen.effects):
        kin = {*candidate.same_as, *candidate.hard_to_tell_from}
        rest = [other for other in chosen.candidates if other is not candidate]
        if rest and len(set(substitutes(candidate, chosen, rounds, settings)) - kin) >= _MANY:
            without = chosen.fit.model.put(candidate.none)
            return fit_hypothesis(data, without, always, rest, _LIGHTER_ROUNDS)
    return chosen


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
    return gain >= _threshold(hypothesis.candidates[-1], settings) and hypothesis.size >= lines.least


def _threshold(candidate: Candidate, settings: Settings) -> float:
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
