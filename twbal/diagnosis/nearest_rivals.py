"""Effects that do nearly the same as one of a set, fitted in its place from where all else is.

A delay of the command, a lag of the motors and a late IMU that take the same time do nearly the same. Without either,
a fit moves all else until something stands in for the time, such as angles that are read before rates. From there the
other one is not found, and the one that was found first looks sure.

An effect may be a special case of another: Stribeck friction without a breakaway is Coulomb friction. Where the fit of
the special case ended short, the other one takes its place, and comes to the same values.

So these are fitted with the time, or the values, of the one that was found.
"""

from collections.abc import Callable, Mapping

from twbal.core.threads import in_threads
from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.hypothesis import ALIKE, FULL_ROUNDS, FittedHypothesis, Round
from twbal.diagnosis.problem import Problem, Selection


def with_nearest_rivals(problem: Problem, selection: Selection, progress: Callable[[str], None]) -> Selection:
    """The selection with sets of nearly the same effects, and with the likeliest of them if that is likelier.

    Args:
        problem: what was selected from.
        selection: how it went.
        progress: is told what is being done, a line at a time.
    """
    chosen = selection.chosen
    tried = [
        (out, other, begin)
        for out in chosen.effects
        for other in problem.beside(chosen, out)
        if (begin := _begin(chosen, out, other))
    ]
    if not tried:
        return selection

    def fit(task: tuple[Candidate, Candidate, Mapping[str, float]]) -> FittedHypothesis:
        out, other, begin = task
        model = chosen.fit.model.put({**out.none, **begin})
        return problem.fit(model, [*(c for c in chosen.candidates if c is not out), other], FULL_ROUNDS)

    progress(f"trying {', '.join(dict.fromkeys(other.name for _, other, _ in tried))} with the values of the others")
    fitted = sorted(in_threads(fit, tried), key=lambda w: w.bic)
    is_better = fitted[0].bic < chosen.bic - ALIKE and problem.is_sound(fitted[0], selection.base)
    rounds = (*selection.rounds, Round(chosen, [], fitted))
    return selection._replace(rounds=rounds, chosen=fitted[0] if is_better else chosen)


def _begin(chosen: FittedHypothesis, out: Candidate, other: Candidate) -> dict[str, float]:
    """Where an effect begins in the place of one of the set, by field; empty where it does not do nearly the same."""
    known = {(p.name, p.unit): chosen.fit.model.value(out.field(p)) for p in out.parameters}
    if _is_time(out) and _is_time(other):
        (time,) = known.values()
        return {other.field(other.parameters[0]): time}
    own = {(p.name, p.unit): other.field(p) for p in other.parameters}
    is_special_case = other.name in out.hard_to_tell_from and own.keys() < known.keys()
    return {field: known[key] for key, field in own.items()} if is_special_case else {}


def _is_time(candidate: Candidate) -> bool:
    """Whether all that it is, is a time."""
    return [p.unit for p in candidate.parameters] == ["s"]
