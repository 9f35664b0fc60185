"""Effects of the same lateness, each in the place of the other.

A delay of the command, a lag of the motors and a late IMU that take the same time do nearly the same. Without either,
a fit moves all else until something stands in for the time, such as angles that are read before rates. From there the
other one is not found, and the one that was found first looks sure. So the others are fitted with its time, from where
all else is.
"""

from collections.abc import Callable

from twbal.core.threads import in_threads
from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.hypothesis import ALIKE, FULL_ROUNDS, FittedHypothesis, Round
from twbal.diagnosis.problem import Problem, Selection


def with_late_rivals(problem: Problem, selection: Selection, progress: Callable[[str], None]) -> Selection:
    """The selection with sets that are late in another way, and with the likeliest of them if that is likelier.

    Args:
        problem: what was selected from.
        selection: how it went.
        progress: is told what is being done, a line at a time.
    """
    chosen = selection.chosen
    tried = [(out, other) for out in chosen.effects if _is_time(out) for other in _others(problem, chosen, out)]
    if not tried:
        return selection

    def fit(pair: tuple[Candidate, Candidate]) -> FittedHypothesis:
        out, other = pair
        (time,) = out.parameters
        begin = chosen.fit.model.put(
            {**out.none, other.field(other.parameters[0]): chosen.fit.model.value(out.field(time))}
        )
        return problem.fit(begin, [*(c for c in chosen.candidates if c is not out), other], FULL_ROUNDS)

    progress(f"trying {', '.join(dict.fromkeys(other.name for _, other in tried))} of the same time")
    fitted = sorted(in_threads(fit, tried), key=lambda w: w.bic)
    is_better = fitted[0].bic < chosen.bic - ALIKE and problem.is_sound(fitted[0], selection.base)
    rounds = (*selection.rounds, Round(chosen, [], fitted))
    return selection._replace(rounds=rounds, chosen=fitted[0] if is_better else chosen)


def _others(problem: Problem, chosen: FittedHypothesis, out: Candidate) -> list[Candidate]:
    return [candidate for candidate in problem.beside(chosen, out) if _is_time(candidate)]


def _is_time(candidate: Candidate) -> bool:
    """Whether all that it is, is a time."""
    return [p.unit for p in candidate.parameters] == ["s"]
