"""A search that begins with what nearly every robot has, all at once, from the data sheet as it is.

A robot with a weak motor, friction, a delay and a centre of mass that is not where its sheet says hides all of these
from a search that adds one after the other: the first effect has to do the work of the others. A slope of the ground
and a battery that sags then explain four falls of a robot that has neither. All at once, they are found.
"""

from collections.abc import Callable

from twbal.diagnosis.problem import Problem, Selection
from twbal.diagnosis.removal import without_redundant
from twbal.diagnosis.tempered import added_to, better_of

USUAL = (
    "torque_gain",
    "com_offset",
    "actuation_delay",
    "coulomb_friction",
    "viscous_friction",
    "dead_zone",
    "tilt_filter",
)
"""What hardly a robot is without: in some size each of these is a matter of course."""


def search_from_usual(problem: Problem, selection: Selection, progress: Callable[[str], None]) -> Selection:
    """The better of a selection and of what is found from the usual effects on, of which those of no use go again.

    Where all of them, without any penalty, explain less than the selection's set, it stays: they are no better start.

    Args:
        problem: what is selected from.
        selection: how earlier searches went.
        progress: is told what is being done, a line at a time.
    """

    def say(line: str) -> None:
        progress(f"third search: {line}")

    usual = [candidate for candidate in problem.candidates if candidate.name in USUAL]
    if not usual:
        return selection
    say(f"fitting {', '.join(candidate.name for candidate in usual)} at once")
    at_once, rounds = problem.fit_at_once(usual), list(selection.rounds)
    if at_once.fit.cost > selection.chosen.bic:
        return selection
    say("fitting fewer of them")
    begun = without_redundant(problem, at_once, selection.base, afresh=True, rounds=rounds)
    if not begun.candidates:
        return selection
    return better_of(problem, selection, added_to(problem, begun, rounds, say), rounds, say)
