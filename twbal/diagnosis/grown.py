"""More effects for a set that a search changed after it last asked what to add.

A search ends by taking off what is not needed and by trying similar effects. What was of no use beside the larger set,
or beside the other effect, may be worth its penalty beside what is left.
"""

from collections.abc import Callable, Sequence

from twbal.diagnosis.hypothesis import FittedHypothesis, Round
from twbal.diagnosis.problem import Problem, Selection
from twbal.diagnosis.removal import without_redundant
from twbal.diagnosis.tempered import added_to

_TIMES = 3  # that effects are added and others taken off, at most


def grown(problem: Problem, selection: Selection, progress: Callable[[str], None]) -> Selection:
    """The selection with what its set still asks for, and without what that makes needless.

    Args:
        problem: what was selected from.
        selection: how all searches went.
        progress: is told what is being done, a line at a time.
    """
    chosen, rounds = selection.chosen, list(selection.rounds)
    for _ in range(_TIMES):
        if not chosen.candidates or _is_asked(chosen, rounds):
            break
        larger = added_to(problem, chosen, rounds, progress)
        found = without_redundant(problem, larger, selection.base, rounds=rounds) if larger is not chosen else chosen
        if found.at_bound or found.bic >= chosen.bic:
            break
        chosen = found
    return Selection(selection.base, tuple(rounds), chosen)


def _is_asked(chosen: FittedHypothesis, rounds: Sequence[Round]) -> bool:
    """Whether all other effects were weighed beside a set."""
    return any(step.base.names == chosen.names and step.scored for step in rounds)
