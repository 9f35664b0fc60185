"""Which effects to name: forward selection, one effect after the other, as long as the data ask for more."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from math import ceil, isfinite, sqrt
from typing import NamedTuple

from twbal.core.threads import in_threads
from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.hypothesis import (
    ALIKE,
    FULL_ROUNDS,
    FittedHypothesis,
    Round,
    add_one,
    fit_from_all,
    fit_hypothesis,
)
from twbal.diagnosis.score_test import score_candidates
from twbal.diagnosis.settings import Settings
from twbal.sysid.model import Data, FreeParameter, Model

_BASE_ROUNDS, _LIGHTER_ROUNDS, _AT_ONCE_ROUNDS = 8, 3, 12
_BEGIN = 0.3  # share of their start values at which several effects begin at once
_FAR_WORSE = 20.0  # times the least loss that is worth naming, from which on the noise need not be fitted to be sure
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
        """The best fit of every set of effects that was fitted; without sets whose predictions diverge."""
        best: dict[tuple[str, ...], FittedHypothesis] = {}
        for w in (self.base, self.chosen, *(w for step in self.rounds for w in (step.base, *step.hypotheses))):
            if isfinite(w.bic) and (w.names not in best or w.bic < best[w.names].bic):
                best[w.names] = w
        return tuple(best.values())

    @property
    def best_fitted(self) -> "Selection":
        """The same with the best fit of its set of effects, but for one with a parameter at a bound where it has none.

        Searches come to one set in several ways, and fits from other starts may end in another optimum.
        """
        own = (w for w in self.sets if w.names == self.chosen.names)
        best = min(own, key=lambda w: w.bic, default=self.chosen)
        return self if best.at_bound and not self.chosen.at_bound else self._replace(chosen=best)


class Problem(NamedTuple):
    """What a selection works on.

    Attributes:
        data: recordings.
        start: the simulation as it is, with its noise fitted: where fits begin.
        always: what is always free.
        candidates: all that may be named.
        settings: of the diagnosis.
        rounds: of values and noise in turn, for each candidate that is fitted in full.
    """

    data: Data
    start: Model
    always: Sequence[FreeParameter]
    candidates: Sequence[Candidate]
    settings: Settings
    rounds: int = FULL_ROUNDS

    def fit(self, model: Model, candidates: Sequence[Candidate], rounds: int) -> FittedHypothesis:
        """A set of effects, fitted in full from a model on."""
        return fit_hypothesis(self.data, model, self.always, candidates, rounds)

    def fit_at_once(self, candidates: Sequence[Candidate]) -> FittedHypothesis:
        """Several effects from a data sheet that is still as it was.

        One by one, the first has to do the work of all the others, and pulls the data sheet away to where the next is
        not found any more.
        """
        small = {c.field(p): p.none + _BEGIN * (p.start - p.none) for c in candidates for p in c.parameters}
        begin = self.data.with_noise(self.start.put(small), 30)
        return fit_from_all(self.data, begin, self.always, candidates, _AT_ONCE_ROUNDS, candidates)

    def add_to(self, hypothesis: FittedHypothesis) -> Round:
        """What one more effect would bring."""
        return add_one(
            self.data, hypothesis, self.always, self.beside(hypothesis), self.settings.shortlist, self.rounds
        )

    def beside(self, hypothesis: FittedHypothesis, out: Candidate | None = None) -> list[Candidate]:
        """Candidates that a set does not hold and that may stand in it, in the place of one that goes `out` if any."""
        rest = set(hypothesis.names) - ({out.name} if out else set())
        return [c for c in self.candidates if c.name not in hypothesis.names and c.may_stand_beside(rest)]

    def shortened(self, instants: int) -> "Problem":
        """The same with the beginnings of the recordings, as many instants as asked for or a few more."""
        share = min(instants / self.data.count, 1.0)
        parts = [recording.part(0, ceil(share * len(recording))) for recording in self.data.recordings]
        return self._replace(data=replace(self.data, recordings=parts))

    def hastier(self, shortlist: int, rounds: int) -> "Problem":
        """The same with so many candidates fitted in full, by so many rounds of values and noise in turn."""
        return self._replace(settings=replace(self.settings, shortlist=shortlist), rounds=rounds)

    def tempered(self, temperature: float) -> "Problem":
        """The same with a likelihood to the power of one over the temperature, but for a factor of all scores.

        That is as if all tolerances were narrower by the square root of the temperature.
        """
        return self._replace(always=[free._replace(sd=free.sd / sqrt(temperature)) for free in self.always])

    def has_room(self, hypothesis: FittedHypothesis) -> bool:
        """Whether one more effect may be named."""
        most = self.settings.max_effects
        return len(hypothesis.effects) < most and len(hypothesis.candidates) <= most

    def is_sound(self, hypothesis: FittedHypothesis, base: FittedHypothesis) -> bool:
        """Whether a set is worth its penalty beside the refitted data sheet, with nothing negligible or at a bound."""
        return is_sound(hypothesis, base, self.settings)

    def next_from(self, step: Round) -> FittedHypothesis | None:
        """The set of a round to go on from; None where no candidate is worth its penalty."""
        passing = [w for w in step.hypotheses if passes(w, step.base, self.settings)]
        return best_inside(passing, step.base, self.settings) if passing else None


def refitted(problem: Problem, progress: Callable[[str], None] = lambda line: None) -> FittedHypothesis:
    """The data sheet refitted: the set without effects."""
    progress("refitting the nominal parameters")
    return problem.fit(problem.start, (), _BASE_ROUNDS)


def select(problem: Problem, base: FittedHypothesis, progress: Callable[[str], None] = lambda line: None) -> Selection:
    """Add effects to the data sheet as long as they are worth their penalty.

    One that was chosen while another was missing may be the wrong one. So with two effects each is reconsidered with
    the other in place, and of more those go again that are not worth their penalty beside the others.

    Args:
        problem: what is selected from.
        base: the data sheet refitted.
        progress: is told what is being done, a line at a time.
    """
    chosen, rounds = _greedy(problem, base, progress)
    return Selection(base, tuple(rounds), chosen)


def _greedy(
    problem: Problem, base: FittedHypothesis, progress: Callable[[str], None]
) -> tuple[FittedHypothesis, list[Round]]:
    """The set to which a forward selection comes, and its rounds."""
    settings = problem.settings
    chosen, rounds = _one_by_one(problem, base, progress)
    usual = [candidate for candidate in problem.candidates if candidate.name in settings.common_effects]
    if usual and settings.max_effects:
        progress(f"fitting the {len(usual)} usual effects at once, and fewer of them")
        at_once = without_redundant(problem, problem.fit_at_once(usual), base, afresh=True)
        if _wins(at_once, chosen, base, settings):
            return _around(problem, at_once, base, rounds, progress), rounds
    if len(chosen.effects) > 2:
        chosen = without_redundant(problem, chosen, base)
    elif len(chosen.effects) > 1:
        progress(f"reconsidering {chosen.names[0]} beside the others")
        step = _reconsider(problem, chosen)
        rounds.append(step)
        chosen = best_inside(sorted([chosen, *step.hypotheses], key=lambda w: w.bic), base, settings)
        chosen = without_unspecific(problem, without_redundant(problem, chosen, base), rounds)
    return chosen, rounds


def _one_by_one(
    problem: Problem, base: FittedHypothesis, progress: Callable[[str], None]
) -> tuple[FittedHypothesis, list[Round]]:
    """The set to which effects were added one after the other, and the rounds in which they were."""
    settings, rounds, chosen = problem.settings, list[Round](), base
    while len(chosen.effects) < settings.max_effects and len(chosen.candidates) <= settings.max_effects:
        progress(f"weighing what to add to {', '.join(chosen.names) or 'the refit'}")
        step = problem.add_to(chosen)
        rounds.append(step)
        passing = [w for w in step.hypotheses if passes(w, chosen, settings) and adds_enough(w, chosen, base, settings)]
        if not passing:
            break
        chosen = best_inside(passing, chosen, settings)
    if not rounds:  # what the recordings could show is asked of the first round
        rounds.append(Round(base, score_candidates(problem.data, base.fit, problem.candidates), []))
    return chosen, rounds


def _around(
    problem: Problem,
    at_once: FittedHypothesis,
    base: FittedHypothesis,
    rounds: list[Round],
    progress: Callable[[str], None],
) -> FittedHypothesis:
    """The best set near one that was fitted at once: with one more effect, or another in the place of one."""
    settings = problem.settings
    progress(f"weighing what to add to {', '.join(at_once.names)}")
    rounds.append(problem.add_to(at_once))
    passing = [w for w in rounds[-1].hypotheses if passes(w, at_once, settings) and is_sound(w, base, settings)]
    chosen = passing[0] if passing and len(at_once.effects) < settings.max_effects else at_once
    progress("trying others in the place of each effect")
    rounds.append(_swap(problem, chosen))
    # equivalents differ by rounding alone, which must not decide
    ahead = [w for w in rounds[-1].hypotheses if w.bic < chosen.bic - ALIKE]
    better = [w for w in ahead if is_sound(w, base, settings)]
    return better[0] if better else chosen


def _wins(at_once: FittedHypothesis, chosen: FittedHypothesis, base: FittedHypothesis, settings: Settings) -> bool:
    """Whether effects that were fitted at once take the place of those that were found one by one.

    Not with a parameter at a bound where those have none there: two logs of a REGBOT were explained by a centre of mass
    at the lowest height that a fit may try.
    """
    if not at_once.candidates or not passes(at_once, base, settings):
        return False
    if at_once.overriding and chosen.candidates and not chosen.overriding:
        return False
    if at_once.at_bound and chosen.candidates and not chosen.at_bound:
        return False
    margin = settings.least_scores.effect * min(at_once.autocorrelation, settings.thresholds.max_autocorrelation)
    return at_once.bic < chosen.bic + margin or bool(chosen.at_bound and not at_once.at_bound)


def _reconsider(problem: Problem, chosen: FittedHypothesis) -> Round:
    """Fit what could stand in the place of the effect that was chosen first."""
    first, *rest = chosen.candidates
    base = problem.fit(chosen.fit.model.put(first.none), rest, _BASE_ROUNDS)
    left = [candidate for candidate in problem.beside(base) if candidate.name != first.name]
    return add_one(problem.data, base, problem.always, left, max(problem.settings.shortlist // 2, 1))


def _swap(problem: Problem, chosen: FittedHypothesis) -> Round:
    """Fit in each effect's place those that most robots have and those that are hard to tell from it."""
    tried = []
    for out in chosen.effects:
        rest = [candidate for candidate in chosen.candidates if candidate is not out]
        for candidate in problem.beside(chosen, out):
            if candidate.name in problem.settings.common_effects or candidate.name in out.hard_to_tell_from:
                tried.append([*rest, candidate])
    return Round(chosen, [], sorted(in_threads(problem.fit_at_once, tried), key=lambda w: w.bic))


def without_redundant(
    problem: Problem,
    chosen: FittedHypothesis,
    base: FittedHypothesis,
    afresh: bool = False,
    rounds: list[Round] | None = None,
) -> FittedHypothesis:
    """Take off one candidate after the other: those of no use, negligible ones, and more than may be named.

    Of no use is one that gains less than a named one must.

    Args:
        problem: what is selected from.
        chosen: the set.
        base: the data sheet refitted, which is left where none is of use.
        afresh: whether what is left is fitted from the data sheet as it was, too: the way from the larger set may be
            barred. Where something is redundant anyway, only the set without that is.
        rounds: to which the sets with one candidate less are added.
    """
    while chosen.candidates:
        lighter = in_threads(partial(_one_less, problem, chosen, base), chosen.candidates)
        redundant = _redundant(problem, chosen, lighter)
        if afresh:
            fewer = [lighter.index(min(redundant, key=lambda w: w.bic))] if redundant else range(len(lighter))
            for i, anew in zip(fewer, in_threads(partial(_anew, problem), [lighter[i] for i in fewer]), strict=True):
                lighter[i] = anew
            redundant = _redundant(problem, chosen, lighter)
        if rounds is not None:
            rounds.append(Round(chosen, [], lighter))
        if not redundant:
            break
        chosen = min(redundant, key=lambda w: w.bic)
    return chosen


def _redundant(
    problem: Problem, chosen: FittedHypothesis, lighter: Sequence[FittedHypothesis]
) -> list[FittedHypothesis]:
    """Of a set without each of its candidates, in their order, those in which nothing is lost that is worth naming."""
    settings, thresholds = problem.settings, problem.settings.thresholds
    autocorrelation = min(chosen.autocorrelation, thresholds.max_autocorrelation)
    too_many = len(chosen.effects) > settings.max_effects
    return [
        less
        for less, candidate in zip(lighter, chosen.candidates, strict=True)
        if (less.bic - chosen.bic) / autocorrelation < _min_score(candidate, settings)
        or too_many
        or chosen.size_of(candidate) < thresholds.min_effect_size
    ]


def _one_less(
    problem: Problem, chosen: FittedHypothesis, base: FittedHypothesis, candidate: Candidate
) -> FittedHypothesis:
    """A set without one of its candidates."""
    return without(problem, chosen, candidate) if len(chosen.candidates) > 1 else base


def _anew(problem: Problem, less: FittedHypothesis) -> FittedHypothesis:
    """The better fit of a set: as it is, or from the data sheet as it was."""
    return min(less, problem.fit_at_once(less.candidates), key=lambda w: w.bic) if less.candidates else less


def without(problem: Problem, chosen: FittedHypothesis, candidate: Candidate) -> FittedHypothesis:
    """A set without one of its candidates, fitted again; with the noise as it was where it is clearly worse by that."""
    rest = [other for other in chosen.candidates if other is not candidate]
    found = problem.fit(chosen.fit.model.put(candidate.none), rest, 0)
    least = _min_score(candidate, problem.settings) * chosen.autocorrelation
    if found.bic - chosen.bic > _FAR_WORSE * least:
        return found
    return problem.fit(found.fit.model, rest, _LIGHTER_ROUNDS)


def without_unspecific(problem: Problem, chosen: FittedHypothesis, rounds: Sequence[Round]) -> FittedHypothesis:
    """Of two effects, take off the later in whose place many others do as well.

    Where the robot's form of an effect is not quite ours, what is left asks for more, and gladly takes anything.
    """
    for candidate in reversed(chosen.effects):
        kin = {*candidate.same_as, *candidate.hard_to_tell_from}
        rest = [other for other in chosen.candidates if other is not candidate]
        if rest and len(set(substitutes(candidate, chosen, rounds, problem.settings)) - kin) >= _MANY:
            return without(problem, chosen, candidate)
    return chosen


def substitutes(
    candidate: Candidate, chosen: FittedHypothesis, rounds: Sequence[Round], settings: Settings
) -> list[str]:
    """Effects that explain the data as well in the place of one of a set, but for the margin; none that override."""
    found: list[str] = []
    rest = {name for name in chosen.names if name != candidate.name}
    for w in (w for step in rounds for w in step.hypotheses):
        others = set(w.names) - rest
        swapped = len(w.names) == len(chosen.names) and len(others) == 1 and candidate.name not in others
        alike = abs(w.bic - chosen.bic) / chosen.compared_by < settings.thresholds.equivalence_margin
        if swapped and alike and not w.overriding:
            found.extend(others)
    return found


def passes(hypothesis: FittedHypothesis, base: FittedHypothesis, settings: Settings) -> bool:
    """Whether the data ask for what one set has beyond another, the last of its candidates.

    Autocorrelated errors gain too much by chance, so a gain counts over the autocorrelation that is left; but over no
    more than that at which nothing is named anyway, as another effect may still take it away. What is negligible is not
    named, however sure it is: it stands for some trifle of the robot's form.
    """
    thresholds = settings.thresholds
    gain = (base.bic - hypothesis.bic) / min(hypothesis.autocorrelation, thresholds.max_autocorrelation)
    return gain >= _min_score(hypothesis.candidates[-1], settings) and hypothesis.size >= thresholds.min_effect_size


def _min_score(candidate: Candidate, settings: Settings) -> float:
    """Gain over the autocorrelation that is left, from which on a candidate is worth its penalty."""
    return settings.least_scores.data_sheet if candidate.in_data_sheet else settings.least_scores.effect


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
    return not base.effects or gain >= settings.thresholds.min_gain_share * (first.bic - base.bic)


def is_sound(hypothesis: FittedHypothesis, base: FittedHypothesis, settings: Settings) -> bool:
    """Whether a set is worth its penalty beside the refitted data sheet, with nothing negligible or at a bound."""
    negligible = any(
        hypothesis.size_of(candidate) < settings.thresholds.min_effect_size for candidate in hypothesis.candidates
    )
    return passes(hypothesis, base, settings) and not negligible and not hypothesis.at_bound


def best_inside(passing: Sequence[FittedHypothesis], before: FittedHypothesis, settings: Settings) -> FittedHypothesis:
    """The best set; or one with all parameters inside their ranges, where that explains nearly as much.

    One that swallows the commands explains anything; it is the best only where there is no other.
    """
    passing = [w for w in passing if not w.overriding] or passing
    best = passing[0]
    handicap = max(
        3.0 * settings.least_scores.effect * best.autocorrelation,
        settings.thresholds.min_gain_share * (before.bic - best.bic),
    )
    found = [w for w in passing if not w.at_bound and w.bic < best.bic + handicap]
    return found[0] if found else best
