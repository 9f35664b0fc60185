"""Which effects to name: forward selection, one effect after the other, as long as the data ask for more."""

from collections.abc import Callable, Sequence

from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.criteria import adds_enough, at_once_wins, best_inside, is_sound, passes, substitutes, threshold
from twbal.diagnosis.hypothesis import ALIKE, FittedHypothesis, Round, add_one
from twbal.diagnosis.score_test import score_candidates
from twbal.diagnosis.selection import Problem, Selection

_BASE_ROUNDS, _LIGHTER_ROUNDS = 8, 3
_MANY = 3  # effects of other kinds that do as well in the place of one, from which on it is not named beside another


def select(problem: Problem, progress: Callable[[str], None] = lambda line: None) -> Selection:
    """Add effects to the data sheet as long as they are worth their penalty.

    One that was chosen while another was missing may be the wrong one. So with two effects each is reconsidered with
    the other in place, and of more those go again that are not worth their penalty beside the others.

    Args:
        problem: what is selected from.
        progress: is told what is being done, a line at a time.
    """
    progress("refitting the nominal parameters")
    base = problem.fit(problem.start, (), _BASE_ROUNDS)
    chosen, rounds = _greedy(problem, base, progress)
    return Selection(base, tuple(rounds), chosen)


def _greedy(
    problem: Problem, base: FittedHypothesis, progress: Callable[[str], None]
) -> tuple[FittedHypothesis, list[Round]]:
    """The set to which a forward selection comes, and its rounds."""
    settings = problem.settings
    chosen, rounds = _one_by_one(problem, base, progress)
    usual = [candidate for candidate in problem.candidates if candidate.name in settings.common_effects]
    if usual and settings.max_effects:
        progress(f"fitting the {len(usual)} usual effects at once, and fewer of them")
        at_once = without_redundant(problem, problem.fit_at_once(usual), base, afresh=True)
        if at_once_wins(at_once, chosen, base, settings):
            return _around(problem, at_once, base, rounds, progress), rounds
    if len(chosen.effects) > 2:
        chosen = without_redundant(problem, chosen, base)
    elif len(chosen.effects) > 1:
        progress(f"reconsidering {chosen.names[0]} beside the others")
        step = _reconsider(problem, chosen)
        rounds.append(step)
        chosen = best_inside(sorted([chosen, *step.hypotheses], key=lambda w: w.bic), base, settings)
        chosen = without_unspecific(problem, without_redundant(problem, chosen, base), rounds)
    return chosen, rounds


def _one_by_one(
    problem: Problem, base: FittedHypothesis, progress: Callable[[str], None]
) -> tuple[FittedHypothesis, list[Round]]:
    """The set to which effects were added one after the other, and the rounds in which they were."""
    settings, rounds, chosen = problem.settings, list[Round](), base
    while len(chosen.effects) < settings.max_effects and len(chosen.candidates) <= settings.max_effects:
        progress(f"weighing what to add to {', '.join(chosen.names) or 'the refit'}")
        step = problem.add_to(chosen)
        rounds.append(step)
        passing = [w for w in step.hypotheses if passes(w, chosen, settings) and adds_enough(w, chosen, base, settings)]
        if not passing:
            break
        chosen = best_inside(passing, chosen, settings)
    if not rounds:  # what the recordings could show is asked of the first round
        rounds.append(Round(base, score_candidates(problem.data, base.fit, problem.candidates), []))
    return chosen, rounds


def _around(
    problem: Problem,
    at_once: FittedHypothesis,
    base: FittedHypothesis,
    rounds: list[Round],
    progress: Callable[[str], None],
) -> FittedHypothesis:
    """The best set near one that was fitted at once: with one more effect, or another in the place of one."""
    settings = problem.settings
    progress(f"weighing what to add to {', '.join(at_once.names)}")
    rounds.append(problem.add_to(at_once))
    passing = [w for w in rounds[-1].hypotheses if passes(w, at_once, settings) and is_sound(w, base, settings)]
    chosen = passing[0] if passing and len(at_once.effects) < settings.max_effects else at_once
    progress("trying others in the place of each effect")
    rounds.append(_swap(problem, chosen))
    # equivalents differ by rounding alone, which must not decide
    ahead = [w for w in rounds[-1].hypotheses if w.bic < chosen.bic - ALIKE]
    better = [w for w in ahead if is_sound(w, base, settings)]
    return better[0] if better else chosen


def _reconsider(problem: Problem, chosen: FittedHypothesis) -> Round:
    """Fit what could stand in the place of the effect that was chosen first."""
    first, *rest = chosen.candidates
    base = problem.fit(chosen.fit.model.put(first.none), rest, _BASE_ROUNDS)
    left = [candidate for candidate in problem.beside(base) if candidate.name != first.name]
    return add_one(problem.data, base, problem.always, left, max(problem.settings.shortlist // 2, 1))


def _swap(problem: Problem, chosen: FittedHypothesis) -> Round:
    """Fit in each effect's place those that most robots have and those that are hard to tell from it."""
    found = []
    for out in chosen.effects:
        rest = [candidate for candidate in chosen.candidates if candidate is not out]
        for candidate in problem.beside(chosen):
            if candidate.name in problem.settings.common_effects or candidate.name in out.hard_to_tell_from:
                found.append(problem.fit_at_once([*rest, candidate]))
    return Round(chosen, [], sorted(found, key=lambda w: w.bic))


def with_kin(
    problem: Problem,
    chosen: FittedHypothesis,
    lighter: Sequence[FittedHypothesis],
    base: FittedHypothesis,
    rounds: list[Round],
) -> FittedHypothesis:
    """The better of a set and those with an effect in the place of one that it is hard to tell from.

    Args:
        problem: what is selected from.
        chosen: the set.
        lighter: the set without each of its candidates, in their order.
        base: the data sheet refitted.
        rounds: to which what was fitted is added.
    """
    tried = []
    for out, less in zip(chosen.candidates, lighter, strict=True):
        kin = [candidate for candidate in problem.beside(chosen) if candidate.name in out.hard_to_tell_from]
        if kin:
            step = add_one(problem.data, less, problem.always, kin, len(kin), problem.rounds)
            rounds.append(Round(less, [], [*step.hypotheses, chosen]))
            tried += step.hypotheses
    better = [w for w in tried if w.bic < chosen.bic - ALIKE and is_sound(w, base, problem.settings)]
    return min(better, key=lambda w: w.bic) if better else chosen


def without_redundant(
    problem: Problem,
    chosen: FittedHypothesis,
    base: FittedHypothesis,
    afresh: bool = False,
    rounds: list[Round] | None = None,
) -> FittedHypothesis:
    """Take off one candidate after the other: those of no use, negligible ones, and more than may be named.

    Of no use is one that gains less than a named one must.

    Args:
        problem: what is selected from.
        chosen: the set.
        base: the data sheet refitted, which is left where none is of use.
        afresh: whether what is left is fitted from the data sheet as it was, too: the way from the larger set may be
            barred.
        rounds: to which the sets with one candidate less are added.
    """
    settings, lines = problem.settings, problem.settings.lines
    while chosen.candidates:
        autocorrelation = min(chosen.autocorrelation, lines.whiteness)
        too_many = len(chosen.effects) > settings.max_effects
        lighter = [_one_less(problem, chosen, candidate, base, afresh) for candidate in chosen.candidates]
        if rounds is not None:
            rounds.append(Round(chosen, [], lighter))
        redundant = [
            less
            for less, candidate in zip(lighter, chosen.candidates, strict=True)
            if (less.bic - chosen.bic) / autocorrelation < threshold(candidate, settings)
            or too_many
            or chosen.size_of(candidate) < lines.least
        ]
        if not redundant:
            break
        chosen = min(redundant, key=lambda w: w.bic)
    return chosen


def _one_less(
    problem: Problem, chosen: FittedHypothesis, candidate: Candidate, base: FittedHypothesis, afresh: bool
) -> FittedHypothesis:
    """The better fit of a set without one of its candidates; arguments as of `without_redundant`."""
    rest = [other for other in chosen.candidates if other is not candidate]
    if not rest:
        return base
    lighter = without(problem, chosen, candidate)
    return min(lighter, problem.fit_at_once(rest), key=lambda w: w.bic) if afresh else lighter


def without(problem: Problem, chosen: FittedHypothesis, candidate: Candidate) -> FittedHypothesis:
    """A set without one of its candidates, fitted again."""
    rest = [other for other in chosen.candidates if other is not candidate]
    return problem.fit(chosen.fit.model.put(candidate.none), rest, _LIGHTER_ROUNDS)


def without_unspecific(problem: Problem, chosen: FittedHypothesis, rounds: Sequence[Round]) -> FittedHypothesis:
    """Of two effects, take off the later in whose place many others do as well.

    Where the robot's form of an effect is not quite ours, what is left asks for more, and gladly takes anything.
    """
    for candidate in reversed(chosen.effects):
        kin = {*candidate.same_as, *candidate.hard_to_tell_from}
        rest = [other for other in chosen.candidates if other is not candidate]
        if rest and len(set(substitutes(candidate, chosen, rounds, problem.settings)) - kin) >= _MANY:
            return without(problem, chosen, candidate)
    return chosen
