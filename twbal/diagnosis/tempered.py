"""A search for robots that lack several effects at once, by a tempered likelihood.

While several effects are missing, the prediction errors stay autocorrelated, and a likelihood that counts every instant
as a new one is far too sure. It pulls the data sheet out of its tolerances to make up for what is missing, and from
there no single effect helps. Here it counts over the autocorrelation of the errors (a power likelihood), which is the
same as tolerances that are narrower by its square root. They widen as effects are found.
"""

from collections.abc import Callable

from twbal.diagnosis.criteria import best_inside, passes
from twbal.diagnosis.hypothesis import FittedHypothesis, Round
from twbal.diagnosis.problem import Problem

_INSTANTS = 2000  # of the recordings' beginnings that are searched first
_SHORTLIST, _FULL_ROUNDS = 4, 2  # candidates that are fitted in full in each round; of values and noise in turn
_ROUNDS, _LAST_ROUNDS = 3, 8  # of values and noise in turn, of the set so far and of the last one


def tempered_search(
    problem: Problem, base: FittedHypothesis, progress: Callable[[str], None]
) -> tuple[FittedHypothesis, list[Round]]:
    """Add effects one after the other to the beginnings of the recordings, and go on with all that was recorded.

    Args:
        problem: what is searched.
        base: the data sheet refitted, whose autocorrelation is the first temperature.
        progress: is told what is being done, a line at a time.

    Returns:
        The set that this comes to, and the rounds with all recordings and with the tolerances as they are.
    """
    found = _begun(problem, base, progress)
    found, rounds = problem.fit(found.fit.model, found.candidates, _LAST_ROUNDS), list[Round]()
    while _has_room(problem, found):
        progress(f"weighing what to add to {', '.join(found.names) or 'the refit'}")
        rounds.append(problem.add_to(found))
        passing = [w for w in rounds[-1].hypotheses if passes(w, found, problem.settings)]
        if not passing:
            break
        found = best_inside(passing, found, problem.settings)
    return found, rounds


def _begun(problem: Problem, base: FittedHypothesis, progress: Callable[[str], None]) -> FittedHypothesis:
    """What a tempered likelihood of the recordings' beginnings finds."""
    hasty = problem.hastier(_SHORTLIST, _FULL_ROUNDS).shortened(_INSTANTS)
    found = hasty.tempered(base.autocorrelation).fit(hasty.start, (), _ROUNDS)
    while _has_room(hasty, found):
        tempered = hasty.tempered(found.autocorrelation)
        before = tempered.fit(found.fit.model, found.candidates, _ROUNDS)
        progress(f"tempered by {found.autocorrelation:.3g}, adding to {', '.join(before.names) or 'the data sheet'}")
        passing = [w for w in tempered.add_to(before).hypotheses if passes(w, before, problem.settings)]
        if not passing:
            return before
        found = best_inside(passing, before, problem.settings)
    return found


def _has_room(problem: Problem, found: FittedHypothesis) -> bool:
    """Whether more may be named."""
    most = problem.settings.max_effects
    return len(found.effects) < most and len(found.candidates) <= most
