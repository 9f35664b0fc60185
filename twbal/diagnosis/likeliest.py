"""The likeliest set of effects in the place of one that a selection came to by another way.

A selection goes step by step, and prefers sets without a parameter at a bound. So it may end with a set although
another that it fitted on its way is much likelier by the same data.
"""

from collections.abc import Callable, Mapping

from twbal.diagnosis.hypothesis import FittedHypothesis
from twbal.diagnosis.objections import Objection, spaced
from twbal.diagnosis.probable import near_equivalents, probability_of
from twbal.diagnosis.record import LIKELY
from twbal.diagnosis.select import Problem, Selection, is_sound, without_redundant
from twbal.diagnosis.settings import Settings
from twbal.diagnosis.verdict import probabilities

_CLEARLY = 2.0  # times as likely, from which on another set takes the place of the one that was chosen


def with_likeliest(problem: Problem, selection: Selection, progress: Callable[[str], None]) -> Selection:
    """The selection, ended with the likeliest set that nothing is wrong with, where that is clearly likelier.

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
    rounds = [*selection.rounds, problem.add_to(best)]
    found = without_redundant(problem, best, selection.base, rounds=rounds)
    return Selection(selection.base, tuple(rounds), best if found.at_bound else found)


def outweighed(selection: Selection, weights: Mapping[tuple[str, ...], float], settings: Settings) -> list[Objection]:
    """To effects of the chosen set that are less likely missing than not, as other sets do without them."""
    chosen, found = selection.chosen, []
    for candidate in chosen.effects:
        near = near_equivalents(candidate, selection, settings)
        chance = probability_of(candidate, weights, near, chosen.names)
        if chance < LIKELY:
            best = max(weights, key=lambda names: weights[names])
            what = f"{', '.join(map(spaced, best))} ({weights[best]:.0%})" if best else f"none ({weights[best]:.0%})"
            text = f"Sets of effects without the {spaced(candidate.name)} are likelier; the likeliest is {what}."
            found.append(Objection(text, (candidate.name,), is_of_weights=True))
    return found


def _weight_of(chosen: FittedHypothesis, weights: Mapping[tuple[str, ...], float]) -> float:
    """Of a set, and of those that hold it."""
    return sum(weight for names, weight in weights.items() if set(chosen.names) <= set(names))


def _are_nested(one: set[str], other: set[str]) -> bool:
    return one <= other or other <= one
