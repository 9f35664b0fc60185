"""A search for robots that lack several effects at once, by a tempered likelihood.

While several effects are missing, the prediction errors stay autocorrelated, and a likelihood that counts every instant
as a new one is far too sure. It pulls the data sheet out of its tolerances to make up for what is missing, and from
there no single effect helps. Here it counts over the autocorrelation of the errors (a power likelihood), which is the
same as tolerances that are narrower by its square root. They widen as effects are found.

Any further search adds to a set (`added_to`) and is held against the searches before it (`better_of`) in the same way.

Where the set that is found in the end still pulls the data sheet away, so does what no effect explains. Then its values
are those of such a likelihood, too (`settled`).
"""

from collections.abc import Callable
from functools import partial
from math import isfinite

from twbal.core.errors import DataError
from twbal.diagnosis.hypothesis import FittedHypothesis, Round
from twbal.diagnosis.problem import Problem, Selection
from twbal.diagnosis.removal import without_redundant

_INSTANTS = 2000  # of the recordings' beginnings that are searched first
_SHORTLIST, _FULL_ROUNDS = 4, 2  # candidates that are fitted in each round; rounds of values and noise in turn
_ROUNDS, _LAST_ROUNDS = 3, 8  # of values and noise in turn, of the set so far and of the last one
_SETTLING = 3  # fits in turn with the temperature that the last one leaves


def search_again(problem: Problem, selection: Selection, progress: Callable[[str], None]) -> Selection:
    """The better of a selection and of what a tempered likelihood finds.

    Args:
        problem: what is selected from.
        selection: how the first search went.
        progress: is told what is being done, a line at a time.
    """
    found, rounds = tempered_search(problem, selection, progress)
    return better_of(problem, selection, found, rounds, partial(_said, progress, "second search"))


def better_of(
    problem: Problem,
    selection: Selection,
    found: FittedHypothesis,
    rounds: list[Round],
    progress: Callable[[str], None],
) -> Selection:
    """The better of a selection and of a set that another search came to, without what is not needed there.

    Args:
        problem: what is selected from.
        selection: how it went so far.
        found: the other set.
        rounds: of all searches, the other one among them.
        progress: is told what is being done, a line at a time.
    """
    progress(f"removing what is not needed from {', '.join(found.names) or 'the refit'}")
    found = without_redundant(problem, found, selection.base, rounds=rounds)
    if not found.candidates or found.bic >= selection.chosen.bic:
        return selection
    return Selection(selection.base, tuple(rounds), found)


def added_to(
    problem: Problem, found: FittedHypothesis, rounds: list[Round], progress: Callable[[str], None]
) -> FittedHypothesis:
    """A set with more effects, one after the other as long as they are worth it.

    Args:
        problem: what is selected from.
        found: the set.
        rounds: of all searches so far, which are not gone through again; those that follow are added.
        progress: is told what is being done, a line at a time.
    """
    while problem.has_room(found):
        progress(f"weighing what to add to {', '.join(found.names) or 'the refit'}")
        step = problem.add_to(found, rounds)
        if not any(step is known for known in rounds):
            rounds.append(step)
        better = problem.next_from(step)
        if better is None:
            break
        found = better
    return found


def _said(progress: Callable[[str], None], search: str, line: str) -> None:
    progress(f"{search}: {line}")


def tempered_search(
    problem: Problem, selection: Selection, progress: Callable[[str], None]
) -> tuple[FittedHypothesis, list[Round]]:
    """Add effects one after the other to the beginnings of the recordings, and go on with all that was recorded.

    Args:
        problem: what is searched.
        selection: how earlier searches went; the autocorrelation of the data sheet refitted is the first temperature.
        progress: is told what is being done, a line at a time.

    Returns:
        The set that this comes to, and the rounds of all searches with all recordings and the tolerances as they are.
    """
    begun, rounds = _begun(problem, selection.base, progress), list(selection.rounds)
    try:
        found = problem.fit(begun.fit.model, begun.candidates, _LAST_ROUNDS)
    except DataError:  # nothing was found, and by the values of the beginnings later predictions diverge
        found = selection.base
    return added_to(problem, found, rounds, partial(_said, progress, "second search")), rounds


def _begun(problem: Problem, base: FittedHypothesis, progress: Callable[[str], None]) -> FittedHypothesis:
    """What a tempered likelihood of the recordings' beginnings finds."""
    hasty = problem.hastier(_SHORTLIST, _FULL_ROUNDS).shortened(_INSTANTS)
    found = hasty.tempered(base.autocorrelation).fit(hasty.start, (), _ROUNDS)
    while hasty.has_room(found):
        tempered = hasty.tempered(found.autocorrelation)
        before = tempered.fit(found.fit.model, found.candidates, _ROUNDS)
        progress(f"second search, likelihood tempered: adding to {', '.join(before.names) or 'the data sheet'}")
        better = tempered.next_from(tempered.add_to(before))
        if better is None:
            return before
        found = better
    return found


def settled(problem: Problem, chosen: FittedHypothesis) -> FittedHypothesis:
    """A set with the values of a likelihood that counts over the autocorrelation of the errors.

    A model that lacks something leaves autocorrelated errors, and a likelihood that counts every instant as a new one
    pays for each small gain with values of the data sheet that the robot cannot have. What the set gains is still that
    of the likelihood as it is, as other sets are compared with it.

    Args:
        problem: what it was selected from.
        chosen: the set.
    """
    found = chosen
    for _ in range(_SETTLING):
        temperature = found.autocorrelation
        narrower = [candidate.tempered(temperature) for candidate in chosen.candidates]
        fitted = problem.tempered(temperature).fit(found.fit.model, narrower, _LAST_ROUNDS)
        if not (isfinite(fitted.bic) and isfinite(fitted.autocorrelation)):  # predictions diverge
            return chosen
        found = fitted._replace(candidates=chosen.candidates, temperature=temperature)
    return found._replace(fit=found.fit._replace(cost=chosen.fit.cost), unsettled=chosen.autocorrelation)
