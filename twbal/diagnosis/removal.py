"""Which effects of a set go again: those that are not worth their penalty beside the others."""

from collections.abc import Sequence
from functools import partial
from math import isfinite

from twbal.core.threads import in_threads
from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.hypothesis import FittedHypothesis, Round
from twbal.diagnosis.problem import Problem, is_as_good

_LIGHTER_ROUNDS = 3
_FAR_WORSE = 20.0  # times the least loss that is worth naming, from which on the noise need not be fitted to be sure
_MANY = 3  # effects of other kinds that do as well in the place of one, from which on it is not named beside another


def without_redundant(
    problem: Problem,
    chosen: FittedHypothesis,
    base: FittedHypothesis,
    afresh: bool = False,
    rounds: list[Round] | None = None,
) -> FittedHypothesis:
    """Take off the candidates that are of no use, negligible ones, and more than may be named.

    Of no use is one that gains less than a named one must. Those go together where all of them gain no more than one
    must; else one goes after the other, as each may be of use only while another is there.

    Args:
        problem: what is selected from.
        chosen: the set.
        base: the data sheet refitted, which is left where none is of use.
        afresh: whether what is left is fitted from the data sheet as it was, too: the way from the larger set may be
            barred. Where something is redundant anyway, only the set without that is.
        rounds: in which sets are looked up, and to which those with candidates less are added.
    """
    rounds = [] if rounds is None else rounds
    while chosen.candidates:
        known = tuple(rounds)
        lighter = in_threads(partial(_one_less, problem, chosen, base, known), chosen.candidates)
        redundant = _redundant(problem, chosen, lighter)
        if afresh:
            fewer = [lighter.index(min(redundant, key=lambda w: w.bic))] if redundant else range(len(lighter))
            for i, anew in zip(fewer, in_threads(partial(_anew, problem), [lighter[i] for i in fewer]), strict=True):
                lighter[i] = anew
            redundant = _redundant(problem, chosen, lighter)
        rounds.append(Round(chosen, [], lighter))
        if not redundant:
            break
        together = _all_less(problem, chosen, base, lighter, redundant, afresh)
        chosen = min(redundant, key=lambda w: w.bic) if together is None else together
    return chosen


def _redundant(
    problem: Problem, chosen: FittedHypothesis, lighter: Sequence[FittedHypothesis]
) -> list[FittedHypothesis]:
    """Of a set without each of its candidates, in their order, those in which nothing is lost that is worth naming.

    None of them diverges.
    """
    return [
        less
        for less, candidate in zip(lighter, chosen.candidates, strict=True)
        if isfinite(less.bic)
        and (
            less.bic - chosen.bic < problem.least_gain(candidate, chosen)
            or problem.is_too_large(chosen)
            or problem.is_trifle(chosen, candidate)
        )
    ]


def _all_less(
    problem: Problem,
    chosen: FittedHypothesis,
    base: FittedHypothesis,
    lighter: Sequence[FittedHypothesis],
    redundant: Sequence[FittedHypothesis],
    afresh: bool,
) -> FittedHypothesis | None:
    """A set without all of its redundant candidates; None where that loses more than one must gain, or there is one."""
    gone = [c for c, less in zip(chosen.candidates, lighter, strict=True) if any(less is w for w in redundant)]
    if len(gone) < 2 or problem.is_too_large(chosen):
        return None
    rest = [candidate for candidate in chosen.candidates if candidate not in gone]
    if rest:
        none = {field: value for candidate in gone for field, value in candidate.none.items()}
        found = problem.fit(chosen.fit.model.put(none), rest, _LIGHTER_ROUNDS)
        found = _anew(problem, found) if afresh else found
    else:
        found = base
    best = min(chosen.bic, *(less.bic for less in redundant))
    return found if found.bic - best < min(problem.least_gain(candidate, chosen) for candidate in gone) else None


def _one_less(
    problem: Problem, chosen: FittedHypothesis, base: FittedHypothesis, known: Sequence[Round], candidate: Candidate
) -> FittedHypothesis:
    """A set without one of its candidates."""
    return without(problem, chosen, candidate, known) if len(chosen.candidates) > 1 else base


def _anew(problem: Problem, less: FittedHypothesis) -> FittedHypothesis:
    """The better fit of a set: as it is, or from the data sheet as it was."""
    return min(less, problem.fit_at_once(less.candidates), key=lambda w: w.bic) if less.candidates else less


def without(
    problem: Problem, chosen: FittedHypothesis, candidate: Candidate, known: Sequence[Round] = ()
) -> FittedHypothesis:
    """A set without one of its candidates, fitted again; with the noise as it was where it is clearly worse by that.

    Args:
        problem: what is selected from.
        chosen: the set.
        candidate: that goes.
        known: rounds; where one of them has the set fitted as well, and without the candidate, that fit serves.
    """
    rest = [other for other in chosen.candidates if other is not candidate]
    names = tuple(sorted(other.name for other in rest))
    for w in (w for step in known if is_as_good(step.base, chosen) for w in step.hypotheses):
        if w.names == names:
            return w
    found = problem.fit(chosen.fit.model.put(candidate.none), rest, 0)
    if found.bic - chosen.bic > _FAR_WORSE * problem.least_score(candidate) * chosen.autocorrelation:
        return found
    return problem.fit(found.fit.model, rest, _LIGHTER_ROUNDS)


def without_unspecific(problem: Problem, chosen: FittedHypothesis, rounds: Sequence[Round]) -> FittedHypothesis:
    """Of two effects, take off the later in whose place many others do as well.

    Where the robot's form of an effect is not quite ours, what is left asks for more, and gladly takes anything.
    """
    for candidate in reversed(chosen.effects):
        kin = {*candidate.same_as, *candidate.hard_to_tell_from}
        rest = [other for other in chosen.candidates if other is not candidate]
        if rest and len(set(substitutes(candidate, chosen, rounds, problem.equivalence_margin)) - kin) >= _MANY:
            return without(problem, chosen, candidate)
    return chosen


def substitutes(candidate: Candidate, chosen: FittedHypothesis, rounds: Sequence[Round], margin: float) -> list[str]:
    """Effects that explain the data as well in the place of one of a set, but for the margin; none that override.

    Nor values of the data sheet: that these may be off is asked of every set.
    """
    found: list[str] = []
    rest = {name for name in chosen.names if name != candidate.name}
    for w in (w for step in rounds for w in step.hypotheses):
        others = set(w.names) - rest
        swapped = len(w.names) == len(chosen.names) and len(others) == 1 and candidate.name not in others
        swapped = swapped and not any(each.in_data_sheet for each in w.candidates if each.name in others)
        alike = abs(w.bic - chosen.bic) / chosen.compared_by < margin
        if swapped and alike and not w.overriding:
            found.extend(others)
    return found
