"""Another effect in the place of one of a set, as long as the recordings become likelier by that.

A search adds one effect after the other. What it added first had to do the work of others that were still missing, and
may be the wrong one. Beside the others it is seen what can take its place: each effect goes in turn, and all candidates
are scored beside what is left. Only exchanges that are predicted to gain about as much are fitted. (This
is local search by exchange, as for the best subset of regressors: A. Miller: Subset Selection in Regression, 2nd ed.,
Chapman & Hall/CRC, 2002, 3.6.)
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from twbal.core.threads import in_threads
from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.hypothesis import FULL_ROUNDS, FittedHypothesis, Round, bic_penalty
from twbal.diagnosis.problem import Problem, Selection, is_as_good
from twbal.diagnosis.removal import without, without_redundant
from twbal.diagnosis.score_test import ScoredCandidate, score_candidates
from twbal.diagnosis.tempered import added_to

_TIMES = 4  # that an effect is exchanged, at most
_IN_PLACE, _FITTED = 2, 6  # exchanges that are fitted, at most: of one effect, and of all
_ROUNDS = 2  # of values and noise in turn, of each that is fitted
_MADE_UP = 0.5  # share of what an effect gained that another must be predicted to gain; predictions leave the noise
_CLOSE = 50.0  # in -2 log likelihood, by which it may fall short of that
_BETTER = 6.0  # gain in BIC by which an exchange must be better, so that it is none between effects that do the same


class _Exchange(NamedTuple):
    """An effect that may take the place of another.

    Attributes:
        rest: the set without the other.
        scored: the effect, beside the rest.
        ratio: its predicted gain less its penalty, over what the other one had gained.
    """

    rest: FittedHypothesis
    scored: ScoredCandidate
    ratio: float


def exchanged(problem: Problem, selection: Selection, progress: Callable[[str], None]) -> Selection:
    """The selection with other effects in the place of some, and with what its set asks for then.

    Args:
        problem: what was selected from.
        selection: how all searches went.
        progress: is told what is being done, a line at a time.
    """
    for _ in range(_TIMES):
        chosen, rounds = selection.chosen, list(selection.rounds)
        if len(chosen.candidates) < 2 or any(_is_of_exchanges(step, chosen) for step in rounds):
            break
        progress(f"trying others in the place of each of {', '.join(chosen.names)}")
        fitted = in_threads(partial(_fitted, problem), _best_predicted(problem, selection, rounds))
        rounds.append(Round(chosen, [], fitted))
        better = [w for w in fitted if w.bic < chosen.bic - _BETTER and problem.is_sound(w, selection.base)]
        if not better:
            return selection._replace(rounds=tuple(rounds))
        best = min(better, key=lambda w: w.bic)
        best = min(best, problem.fit(best.fit.model, best.candidates, FULL_ROUNDS), key=lambda w: w.bic)
        larger = added_to(problem, best, rounds, progress)
        found = without_redundant(problem, larger, selection.base, rounds=rounds)
        is_better = found.candidates and not found.at_bound and found.bic < chosen.bic
        selection = Selection(selection.base, tuple(rounds), found if is_better else best)
    return selection


def _is_of_exchanges(step: Round, chosen: FittedHypothesis) -> bool:
    """Whether a round fitted others in the place of effects of the same set, by a fit as good: two searches met."""
    is_exchanged = all(len(w.names) == len(chosen.names) for w in step.hypotheses)
    return is_as_good(step.base, chosen) and not step.scored and is_exchanged


def _best_predicted(problem: Problem, selection: Selection, rounds: list[Round]) -> list[_Exchange]:
    """Exchanges that may be better, those with the largest ratio first.

    What was scored and fitted beside a set in an earlier round is not tried again.

    Args:
        problem: what was selected from.
        selection: whose set is looked at.
        rounds: to which the set without each effect is added.
    """
    chosen = selection.chosen
    scored = {step.base.names for step in rounds if step.scored}
    out = [c for c in chosen.candidates if tuple(sorted(set(chosen.names) - {c.name})) not in scored]
    known = tuple(rounds)
    lighter = in_threads(lambda candidate: without(problem, chosen, candidate, known), out)
    rounds.append(Round(chosen, [], lighter))
    found = list[_Exchange]()
    for candidate, rest in zip(out, lighter, strict=True):
        found += _in_place(problem, chosen, candidate, rest)
    return sorted(found, key=lambda each: -each.ratio)[:_FITTED]


def _in_place(problem: Problem, chosen: FittedHypothesis, out: Candidate, rest: FittedHypothesis) -> list[_Exchange]:
    """Exchanges of one effect that may be better."""
    lost = max(rest.bic - chosen.bic, 1.0)
    others = [c for c in problem.beside(chosen, out) if c.name not in (out.name, *out.same_as)]
    found = []
    for scored in score_candidates(problem.data, rest.fit, others):
        gained = scored.gain - bic_penalty([scored.candidate], problem.data.count)
        if gained > _MADE_UP * lost - _CLOSE:
            found.append(_Exchange(rest, scored, gained / lost))
    return found[:_IN_PLACE]


def _fitted(problem: Problem, exchange: _Exchange) -> FittedHypothesis:
    """The set with the other effect."""
    scored = exchange.scored
    return problem.fit(scored.model, (*exchange.rest.candidates, scored.candidate), _ROUNDS)
