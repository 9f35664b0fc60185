"""Which effects to name: forward selection, one effect after the other, as long as the data ask for more."""

from collections.abc import Callable

from twbal.core.threads import in_threads
from twbal.diagnosis.hypothesis import ALIKE, FittedHypothesis, Round
from twbal.diagnosis.problem import Problem, Selection
from twbal.diagnosis.removal import without_redundant, without_unspecific
from twbal.diagnosis.score_test import score_candidates

_BASE_ROUNDS = 8


def refitted(problem: Problem, progress: Callable[[str], None] = lambda line: None) -> FittedHypothesis:
    """The data sheet refitted: the set without effects."""
    progress("refitting the nominal parameters")
    return problem.fit(problem.start, (), _BASE_ROUNDS)


def select(problem: Problem, base: FittedHypothesis, progress: Callable[[str], None] = lambda line: None) -> Selection:
    """Add effects to the data sheet as long as they are worth their penalty.

    One that was chosen while another was missing may be the wrong one. So with two effects each is reconsidered with
    the other in place, and of more those go again that are not worth their penalty beside the others.

    Args:
        problem: what is selected from.
        base: the data sheet refitted.
        progress: is told what is being done, a line at a time.
    """
    chosen, rounds = _greedy(problem, base, progress)
    return Selection(base, tuple(rounds), chosen)


def _greedy(
    problem: Problem, base: FittedHypothesis, progress: Callable[[str], None]
) -> tuple[FittedHypothesis, list[Round]]:
    """The set to which a forward selection comes, and its rounds."""
    chosen, rounds = _one_by_one(problem, base, progress)
    usual = problem.common
    if usual:
        progress(f"fitting the {len(usual)} usual effects at once, and fewer of them")
        at_once = without_redundant(problem, problem.fit_at_once(usual), base, afresh=True)
        if _wins(problem, at_once, chosen, base):
            return _around(problem, at_once, base, rounds, progress), rounds
    if len(chosen.effects) > 2:
        chosen = without_redundant(problem, chosen, base, rounds=rounds)
    elif len(chosen.effects) > 1:
        progress(f"reconsidering {chosen.names[0]} beside the others")
        step = _reconsider(problem, chosen)
        rounds.append(step)
        chosen = problem.best_inside(sorted([chosen, *step.hypotheses], key=lambda w: w.bic), base)
        chosen = without_unspecific(problem, without_redundant(problem, chosen, base, rounds=rounds), rounds)
    return chosen, rounds


def _one_by_one(
    problem: Problem, base: FittedHypothesis, progress: Callable[[str], None]
) -> tuple[FittedHypothesis, list[Round]]:
    """The set to which effects were added one after the other, and the rounds in which they were."""
    rounds, chosen = list[Round](), base
    while problem.has_room(chosen):
        progress(f"weighing what to add to {', '.join(chosen.names) or 'the refit'}")
        step = problem.add_to(chosen)
        rounds.append(step)
        passing = [w for w in step.hypotheses if problem.passes(w, chosen) and problem.adds_enough(w, chosen, base)]
        if not passing:
            break
        chosen = problem.best_inside(passing, chosen)
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
    progress(f"weighing what to add to {', '.join(at_once.names)}")
    rounds.append(problem.add_to(at_once))
    passing = [w for w in rounds[-1].hypotheses if problem.passes(w, at_once) and problem.is_sound(w, base)]
    chosen = passing[0] if passing and problem.has_room(at_once) else at_once
    progress("trying others in the place of each effect")
    rounds.append(_swap(problem, chosen))
    # equivalents differ by rounding alone, which must not decide
    ahead = [w for w in rounds[-1].hypotheses if w.bic < chosen.bic - ALIKE]
    better = [w for w in ahead if problem.is_sound(w, base)]
    return better[0] if better else chosen


def _wins(problem: Problem, at_once: FittedHypothesis, chosen: FittedHypothesis, base: FittedHypothesis) -> bool:
    """Whether effects that were fitted at once take the place of those that were found one by one.

    Not with a parameter at a bound where those have none there: two logs of a REGBOT were explained by a centre of mass
    at the lowest height that a fit may try.
    """
    if not at_once.candidates or not problem.passes(at_once, base):
        return False
    if at_once.overriding and chosen.candidates and not chosen.overriding:
        return False
    if at_once.at_bound and chosen.candidates and not chosen.at_bound:
        return False
    return at_once.bic < chosen.bic + problem.least_gain(at_once) or bool(chosen.at_bound and not at_once.at_bound)


def _reconsider(problem: Problem, chosen: FittedHypothesis) -> Round:
    """Fit what could stand in the place of the effect that was chosen first."""
    first, *rest = chosen.candidates
    base = problem.fit(chosen.fit.model.put(first.none), rest, _BASE_ROUNDS)
    return problem.reconsider(base, first)


def _swap(problem: Problem, chosen: FittedHypothesis) -> Round:
    """Fit in each effect's place those that most robots have and those that are hard to tell from it."""
    tried = []
    for out in chosen.effects:
        rest = [candidate for candidate in chosen.candidates if candidate is not out]
        for candidate in problem.beside(chosen, out):
            if candidate in problem.common or candidate.name in out.hard_to_tell_from:
                tried.append([*rest, candidate])
    return Round(chosen, [], sorted(in_threads(problem.fit_at_once, tried), key=lambda w: w.bic))
