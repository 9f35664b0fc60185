"""The likeliest set of effects in the place of one that a selection came to by another way.

A selection goes step by step, and prefers sets without a parameter at a bound. So it may end with a set although
another that it fitted on its way is much likelier by the same data.
"""

from collections.abc import Callable

from twbal.diagnosis.hypothesis import FittedHypothesis, Round
from twbal.diagnosis.objections import Objection, spaced
from twbal.diagnosis.probable import Weights, counts_for
from twbal.diagnosis.record import LIKELY
from twbal.diagnosis.select import Problem, Selection, is_sound, substitutes, without_redundant
from twbal.diagnosis.settings import Settings
from twbal.diagnosis.verdict import probabilities

_CLEARLY = 2.0  # times as likely, from which on another set takes the place of the one that was chosen


def with_likeliest(problem: Problem, selection: Selection, progress: Callable[[str], None]) -> Selection:
    """The selection, ended with the likeliest set that is sound by itself, where that is clearly likelier.

    A set that holds the chosen one, or lies in it, does not take its place: what is worth naming was decided there.

    Args:
        problem: what was selected from.
        selection: how it went.
        progress: is told what is being done, a line at a time.
    """
    weights, chosen = probabilities(selection, problem.settings), set(selection.chosen.names)
    others = [
        w
        for w in selection.sets
        if w.effects and is_sound(w, selection.base, problem.settings) and not _are_nested(chosen, set(w.names))
    ]
    best = max(others, key=lambda w: weights[w.names], default=None)
    if not chosen or best is None or weights[best.names] < _CLEARLY * _weight_of(selection.chosen, weights):
        return selection
    progress(f"weighing the likeliest set, {', '.join(best.names)}")
    rounds = [*selection.rounds, Round(selection.chosen, [], []), problem.add_to(best)]
    found = without_redundant(problem, best, selection.base, rounds=rounds)
    is_another = found.candidates and not _are_nested(chosen, set(found.names))
    return Selection(selection.base, tuple(rounds), found if is_another and not found.at_bound else best)


def outweighed(selection: Selection, weights: Weights, settings: Settings) -> list[Objection]:
    """To effects of the chosen set that are less likely missing than not, as other sets do without them.

    Not to those that are too small to be named.
    """
    chosen, found = selection.chosen, []
    for candidate in chosen.effects:
        near = substitutes(candidate, chosen, selection.rounds, settings)
        without = {n: w for n, w in weights.items() if not counts_for(candidate, n, near, chosen.names)}
        total = sum(without.values())
        if total > 1.0 - LIKELY and chosen.size_of(candidate) >= settings.lines.least:
            best = max(without, key=lambda names: without[names])
            what = ", ".join(map(spaced, best)) or "the data sheet refitted"
            text = f"Sets of effects without the {spaced(candidate.name)} are together likelier ({total:.0%}); the "
            text += f"likeliest of them is {what} ({without[best]:.0%})."
            found.append(Objection(text, (candidate.name,), is_of_weights=True))
    return found


def _weight_of(chosen: FittedHypothesis, weights: Weights) -> float:
    """Of a set, and of those that hold it."""
    return sum(weight for names, weight in weights.items() if set(chosen.names) <= set(names))


def _are_nested(one: set[str], other: set[str]) -> bool:
    return one <= other or other <= one
