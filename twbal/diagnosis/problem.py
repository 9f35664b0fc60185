"""What a selection of effects works on, how it went, and when an effect is worth its penalty."""

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite, sqrt
from typing import NamedTuple

from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.hypothesis import (
    FULL_ROUNDS,
    FittedHypothesis,
    Round,
    add_one,
    fit_from_all,
    fit_hypothesis,
    may_hide_a_filter,
)
from twbal.diagnosis.objections import pulled_values
from twbal.diagnosis.settings import Settings
from twbal.planar.robot_distribution import TILT_FILTER
from twbal.sysid.model import Data, FreeParameter, Model

_AT_ONCE_ROUNDS = 12
_BEGIN = 0.3  # share of their start values at which several effects begin at once
_AS_GOOD = 2.0  # in -2 log likelihood, by which fits of a set may differ that serve a search alike


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

    def add_to(self, hypothesis: FittedHypothesis, known: Sequence[Round] = ()) -> Round:
        """What one more effect would bring; by a known round with the same set, if that was fitted as well there."""
        others = self.beside(hypothesis)
        names = {candidate.name for candidate in others}
        for step in known:
            if is_as_good(step.base, hypothesis) and names <= {each.candidate.name for each in step.scored}:
                return step
        is_tried = any(self._filter_is_useless(step, hypothesis) for step in known)
        return add_one(self.data, hypothesis, self.always, others, self.settings.shortlist, self.rounds, is_tried)

    def add_filter(self, step: Round) -> Round | None:
        """What a filter of the tilt would bring to the set of a round; None where it tells, or such a set may not."""
        base = step.base
        others = [candidate for candidate in self.beside(base) if candidate.name == TILT_FILTER]
        is_fitted = any(TILT_FILTER in w.names for w in step.hypotheses)
        if is_fitted or not others or not may_hide_a_filter(self.data, base):
            return None
        model = base.fit.model.put({others[0].field(p): p.start for p in others[0].parameters})
        found = fit_from_all(self.data, model, self.always, (*base.candidates, *others), self.rounds, others)
        return Round(base, [], [found])

    def _filter_is_useless(self, step: Round, hypothesis: FittedHypothesis) -> bool:
        """Whether a filter of the tilt was fitted beside a part of a set, and was not worth its penalty there."""
        fitted = [w for w in step.hypotheses if set(w.names) - set(step.base.names) == {TILT_FILTER}]
        is_part = set(step.base.names) <= set(hypothesis.names)
        return is_part and bool(fitted) and not any(self.passes(w, step.base) for w in fitted)

    def reconsider(self, base: FittedHypothesis, out: Candidate) -> Round:
        """What others would bring to a set from which one went; half as many are fitted as usual."""
        left = [candidate for candidate in self.beside(base) if candidate.name != out.name]
        return add_one(self.data, base, self.always, left, max(self.settings.shortlist // 2, 1))

    def beside(self, hypothesis: FittedHypothesis, out: Candidate | None = None) -> list[Candidate]:
        """Candidates that a set does not hold and that may stand in it, in the place of one that goes `out` if any."""
        rest = set(hypothesis.names) - ({out.name} if out else set())
        return [c for c in self.candidates if c.name not in hypothesis.names and c.may_stand_beside(rest)]

    def shortened(self, instants: int) -> "Problem":
        """The same with the beginnings of the recordings, as many instants as asked for or a few more."""
        return self._replace(data=self.data.shortened(instants))

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

    def is_too_large(self, hypothesis: FittedHypothesis) -> bool:
        """Whether a set has more effects than may be named."""
        return len(hypothesis.effects) > self.settings.max_effects

    def least_gain(self, candidate: Candidate, beside: FittedHypothesis) -> float:
        """Gain in BIC from which on a candidate is worth its penalty beside the errors that a set leaves."""
        return self.least_score(candidate) * min(beside.autocorrelation, self.settings.thresholds.max_autocorrelation)

    def least_score(self, candidate: Candidate) -> float:
        """As of `least_score`."""
        return least_score(candidate, self.settings)

    @property
    def equivalence_margin(self) -> float:
        """Gain over the autocorrelation, by which sets may differ that explain the data equally well."""
        return self.settings.thresholds.equivalence_margin

    def is_trifle(self, hypothesis: FittedHypothesis, candidate: Candidate) -> bool:
        """Whether an effect of a set is too small to be named."""
        return hypothesis.size_of(candidate) < self.settings.thresholds.min_effect_size

    def best_inside(self, passing: Sequence[FittedHypothesis], before: FittedHypothesis) -> FittedHypothesis:
        """The best set; or one with all parameters inside their ranges, where that explains nearly as much.

        One that swallows the commands explains anything; it is the best only where there is no other.

        Args:
            passing: sets, the best first.
            before: what they were added to.
        """
        passing = [w for w in passing if not w.overriding] or passing
        best = passing[0]
        handicap = max(
            3.0 * self.settings.least_scores.effect * best.autocorrelation,
            self.settings.thresholds.min_gain_share * (before.bic - best.bic),
        )
        found = [w for w in passing if not w.at_bound and w.bic < best.bic + handicap]
        return found[0] if found else best

    def passes(self, hypothesis: FittedHypothesis, base: FittedHypothesis) -> bool:
        """As of `passes`."""
        return passes(hypothesis, base, self.settings)

    def adds_enough(self, hypothesis: FittedHypothesis, base: FittedHypothesis, first: FittedHypothesis) -> bool:
        """Whether another effect gains enough beside what the others gained to be an effect of its own.

        Where the form of a named effect is not quite the robot's, what is left asks for more effects, each for little.

        Args:
            hypothesis: the set with the other effect.
            base: the set without it.
            first: the data sheet refitted.
        """
        gain = base.bic - hypothesis.bic
        return not base.effects or gain >= self.settings.thresholds.min_gain_share * (first.bic - base.bic)

    def pulled_values(self, hypothesis: FittedHypothesis) -> list[str]:
        """As of `pulled_values`."""
        return pulled_values(hypothesis, self.settings)

    def is_sound(self, hypothesis: FittedHypothesis, base: FittedHypothesis) -> bool:
        """Whether a set is worth its penalty beside the refitted data sheet, with nothing negligible or at a bound."""
        negligible = any(self.is_trifle(hypothesis, candidate) for candidate in hypothesis.candidates)
        return self.passes(hypothesis, base) and not negligible and not hypothesis.at_bound

    def next_from(self, step: Round) -> FittedHypothesis | None:
        """The set of a round to go on from; None where no candidate is worth its penalty."""
        passing = [w for w in step.hypotheses if self.passes(w, step.base)]
        return self.best_inside(passing, step.base) if passing else None


def is_as_good(known: FittedHypothesis, found: FittedHypothesis) -> bool:
    """Whether a known fit is of the same set and about as likely, or likelier."""
    return known.names == found.names and known.bic <= found.bic + _AS_GOOD


def passes(hypothesis: FittedHypothesis, base: FittedHypothesis, settings: Settings) -> bool:
    """Whether the data ask for what one set has beyond another, the last of its candidates.

    Autocorrelated errors gain too much by chance, so a gain counts over the autocorrelation that is left; but over no
    more than that at which nothing is named anyway, as another effect may still take it away. What is negligible is not
    named, however sure it is: it stands for some trifle of the robot's form.
    """
    thresholds = settings.thresholds
    gain = (base.bic - hypothesis.bic) / min(hypothesis.autocorrelation, thresholds.max_autocorrelation)
    return gain >= least_score(hypothesis.candidates[-1], settings) and hypothesis.size >= thresholds.min_effect_size


def least_score(candidate: Candidate, settings: Settings) -> float:
    """Gain over the autocorrelation that is left, from which on a candidate is worth its penalty."""
    return settings.least_scores.data_sheet if candidate.in_data_sheet else settings.least_scores.effect
