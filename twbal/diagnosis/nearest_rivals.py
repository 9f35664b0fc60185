"""Effects that do nearly the same as one of a set, fitted in its place from where all else is.

A delay of the command, a lag of the motors and a late IMU that take the same time do nearly the same. Without either,
a fit moves all else until something stands in for the time, such as angles that are read before rates. From there the
other one is not found, and the one that was found first looks sure.

An effect may be a special case of another: Stribeck friction without a breakaway is Coulomb friction. Where the fit of
the special case ended short, the other one takes its place, and comes to the same values.

So these are fitted with the time, or the values, of the one that was found.

Likewise, values of the data sheet may do the work of an effect: rotors that turn with the gears look like another wheel
radius and another height of the centre of mass. From values that are far off, no small step leads to the effect. So it
is fitted with the data sheet as it was.

And an effect may come with another that acts on it. Dry friction bends before it slides, and where a robot moves little
that looks more like viscous friction than like dry friction alone. So both are fitted together in the place of what is
nearly the same as the first of them.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from twbal.core.threads import in_threads
from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.data_sheet import DATA_SHEET, WHEELS
from twbal.diagnosis.hypothesis import ALIKE, FULL_ROUNDS, FittedHypothesis, Round
from twbal.diagnosis.problem import Problem, Selection


class _Rival(NamedTuple):
    """What may take the place of an effect, or of what values of the data sheet do.

    Attributes:
        out: the effect; None: of values of the data sheet.
        others: one effect, or two of which the second acts on the first.
        begin: values that a fit with them begins with, by field.
    """

    out: Candidate | None
    others: tuple[Candidate, ...]
    begin: Mapping[str, float]


def with_nearest_rivals(problem: Problem, selection: Selection, progress: Callable[[str], None]) -> Selection:
    """The selection with sets of nearly the same effects, and with the likeliest of them if that is likelier.

    It has to be sound, but where the selection's set has a parameter at a bound itself.

    Args:
        problem: what was selected from.
        selection: how it went.
        progress: is told what is being done, a line at a time.
    """
    chosen = selection.chosen
    tried = [
        _Rival(out, (other,), {**out.none, **begin})
        for out in chosen.effects
        for other in problem.beside(chosen, out)
        if (begin := _begin(chosen, out, other))
    ]
    tried += [*_in_place_of_the_sheet(problem, chosen), *_with_what_acts_on_them(problem, chosen)]
    if not tried:
        return selection

    def fit(rival: _Rival) -> FittedHypothesis:
        rest = [c for c in chosen.candidates if c is not rival.out]
        return problem.fit(chosen.fit.model.put(rival.begin), [*rest, *rival.others], FULL_ROUNDS)

    names = dict.fromkeys(other.name for rival in tried for other in rival.others)
    progress(f"trying {', '.join(names)} in the place of what does nearly the same")
    fitted = sorted(in_threads(fit, tried), key=lambda w: w.bic)
    is_no_worse = bool(chosen.at_bound) or problem.is_sound(fitted[0], selection.base)
    is_better = fitted[0].bic < chosen.bic - ALIKE and is_no_worse
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


def _in_place_of_the_sheet(problem: Problem, chosen: FittedHypothesis) -> list[_Rival]:
    """Effects that do nearly the same as values of the data sheet that the set pulls out of their tolerances."""
    pulled = set(problem.pulled_values(chosen))
    sheet = {free.field: free.mean for free in problem.always if free.field in (*DATA_SHEET, *WHEELS)}
    return [
        _Rival(None, (other,), {**sheet, **_starts(other)})
        for other in problem.beside(chosen)
        if not other.in_data_sheet and pulled.intersection(other.hard_to_tell_from)
    ]


def _with_what_acts_on_them(problem: Problem, chosen: FittedHypothesis) -> list[_Rival]:
    """Effects that do nearly the same as one of the set, each with another one that acts on it."""
    return [
        _Rival(out, (other, second), {**out.none, **_starts(other), **_starts(second)})
        for out in chosen.effects
        for other in problem.beside(chosen, out)
        for second in problem.candidates
        if other.name in out.hard_to_tell_from and other.name in second.acts_on and second.name not in chosen.names
    ]


def _starts(candidate: Candidate) -> dict[str, float]:
    """Where an effect begins, by field."""
    return {candidate.field(p): p.start for p in candidate.parameters}


def _is_time(candidate: Candidate) -> bool:
    """Whether all that it is, is a time."""
    return [p.unit for p in candidate.parameters] == ["s"]
