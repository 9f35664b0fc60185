"""What a selection of effects works on, and what comes of it."""

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, sqrt
from typing import NamedTuple

from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.criteria import best_inside, passes
from twbal.diagnosis.hypothesis import FULL_ROUNDS, FittedHypothesis, Round, add_one, fit_hypothesis
from twbal.diagnosis.settings import Settings
from twbal.sysid.model import Data, Free, Model

_AT_ONCE_ROUNDS = 12
_BEGIN = 0.3  # share of their start values at which several effects begin at once


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
    always: Sequence[Free]
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
        return self.fit(self.data.with_noise(self.start.put(small), 30), candidates, _AT_ONCE_ROUNDS)

    def add_to(self, hypothesis: FittedHypothesis) -> Round:
        """What one more effect would bring."""
        return add_one(
            self.data, hypothesis, self.always, self.beside(hypothesis), self.settings.shortlist, self.rounds
        )

    def beside(self, hypothesis: FittedHypothesis) -> list[Candidate]:
        """Candidates that a set does not hold."""
        return [candidate for candidate in self.candidates if candidate.name not in hypothesis.names]

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

    def next_from(self, step: Round) -> FittedHypothesis | None:
        """The set of a round to go on from; None where no candidate is worth its penalty."""
        passing = [w for w in step.hypotheses if passes(w, step.base, self.settings)]
        return best_inside(passing, step.base, self.settings) if passing else None
