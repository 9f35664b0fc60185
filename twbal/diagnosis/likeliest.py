"""The likeliest set of effects in the place of one that a selection came to by another way.

A selection goes step by step, and prefers sets without a parameter at a bound. So it may end with a set although
another that it fitted on its way is much likelier by the same data.
"""

from collections.abc import Callable

from twbal.diagnosis.hypothesis import FittedHypothesis, Round
from twbal.diagnosis.probable import Weights
from twbal.diagnosis.select import Problem, Selection, without_redundant

_CLEARLY = 2.0  # times as likely, from which on another set takes the place of the one that was chosen


def with_likeliest(
    problem: Problem, selection: Selection, weights: Weights, progress: Callable[[str], None]
) -> Selection:
    """The selection, ended with the likeliest set that is sound by itself, where that is clearly likelier.

    A set that holds the chosen one, or lies in it, does not take its place: what is worth naming was decided there.

    Args:
        problem: what was selected from.
        selection: how it went.
        weights: of its sets.
        progress: is told what is being done, a line at a time.
    """
    chosen = set(selection.chosen.names)
    others = [
        w
        for w in selection.sets
        if w.effects and problem.is_sound(w, selection.base) and not _are_nested(chosen, set(w.names))
    ]
    best = max(others, key=lambda w: weights[w.names], default=None)
    if not chosen or best is None or weights[best.names] < _CLEARLY * _weight_of(selection.chosen, weights):
        return selection
    progress(f"weighing the likeliest set, {', '.join(best.names)}")
    rounds = [*selection.rounds, Round(selection.chosen, [], []), problem.add_to(best)]
    found = without_redundant(problem, best, selection.base, rounds=rounds)
    is_another = found.candidates and not _are_nested(chosen, set(found.names))
    return Selection(selection.base, tuple(rounds), found if is_another and not found.at_bound else best)


def _weight_of(chosen: FittedHypothesis, weights: Weights) -> float:
    """Of a set, and of those that hold it."""
    return sum(weight for names, weight in weights.items() if set(chosen.names) <= set(names))


def _are_nested(one: set[str], other: set[str]) -> bool:
    return one <= other or other <= one
