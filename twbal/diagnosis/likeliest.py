"""Another set of effects in the place of the one that a selection came to.

A selection goes step by step, and prefers sets without a parameter at a bound. So it may end with a set although
another that it fitted on its way is much likelier by the same data. Or its set holds an effect that can be no finding,
and that the others do not need.
"""

from collections.abc import Callable

from twbal.diagnosis.hypothesis import FULL_ROUNDS, FittedHypothesis, Round
from twbal.diagnosis.objections import Extent, to_bounds, to_slow_waves
from twbal.diagnosis.probable import Weights
from twbal.diagnosis.problem import Problem, Selection
from twbal.diagnosis.removal import without_redundant

_CLEARLY = 2.0  # times as likely, from which on another set takes the place of the one that was chosen
_TRIED = 3  # sets about as likely as the chosen one that may take its place, at most


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
    rounds = [*selection.rounds, Round(selection.chosen, [], []), problem.add_to(best, selection.rounds)]
    found = without_redundant(problem, best, selection.base, rounds=rounds)
    is_another = found.candidates and not _are_nested(chosen, set(found.names))
    return Selection(selection.base, tuple(rounds), found if is_another and not found.at_bound else best)


def without_untenable(
    problem: Problem,
    selection: Selection,
    extent: Extent,
    explains: Callable[[FittedHypothesis], bool],
    progress: Callable[[str], None],
) -> Selection:
    """The selection, ended without effects that can be no finding, where the others explain the recordings.

    Such an effect has a parameter at a bound, replaces the command, or is a wave of which no recording holds enough
    periods. It often stands for what the form of another effect differs by from the robot's.

    Args:
        problem: what was selected from.
        selection: how it went.
        extent: how far the recordings go.
        explains: whether a set explains the recordings.
        progress: is told what is being done, a line at a time.
    """
    chosen = selection.chosen
    objected = {name for o in (*to_bounds(chosen), *to_slow_waves(chosen, extent)) for name in o.effects}
    tenable = [candidate for candidate in chosen.candidates if candidate.name not in objected]
    if not objected or all(candidate.in_data_sheet for candidate in tenable):
        return selection
    progress(f"fitting the others without {', '.join(sorted(objected))}")
    none = {field: value for c in chosen.candidates if c.name in objected for field, value in c.none.items()}
    others = problem.fit(chosen.fit.model.put(none), tenable, FULL_ROUNDS)
    rounds = [*selection.rounds, Round(chosen, [], [others])]
    if explains(others):
        others = without_redundant(problem, others, selection.base, rounds=rounds)
        if others.effects and explains(others):
            chosen = others
    return Selection(selection.base, tuple(rounds), chosen)


def unobjected(
    selection: Selection, weights: Weights, is_objected: Callable[[FittedHypothesis], bool]
) -> FittedHypothesis:
    """The chosen set, or where something speaks against it, one that is about as likely and has nothing against it.

    Effects that do nearly the same make sets of nearly the same likelihood, and a little more of it is no reason for a
    set that can be no finding.

    Args:
        selection: how it went.
        weights: of its sets.
        is_objected: whether something speaks against a set.
    """
    chosen, own = selection.chosen, weights.get(selection.chosen.names, 0.0)
    near = [w for w in selection.sets if w.effects and w.names != chosen.names and weights[w.names] * _CLEARLY > own]
    if not chosen.effects or not near or not is_objected(chosen):
        return chosen
    best = sorted(near, key=lambda w: -weights[w.names])[:_TRIED]
    return next((w for w in best if not is_objected(w)), chosen)


def _weight_of(chosen: FittedHypothesis, weights: Weights) -> float:
    """Of a set, and of those that hold it."""
    return sum(weight for names, weight in weights.items() if set(chosen.names) <= set(names))


def _are_nested(one: set[str], other: set[str]) -> bool:
    return one <= other or other <= one
