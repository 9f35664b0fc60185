"""Which effects to name: forward selection, one effect after the other, as long as the data ask for more."""

from collections.abc import Callable

from twbal.diagnosis.hypothesis import FittedHypothesis, Round
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
    chosen, rounds = _one_by_one(problem, base, progress)
    if len(chosen.effects) > 2:
        chosen = without_redundant(problem, chosen, base, rounds=rounds)
    elif len(chosen.effects) > 1:
        progress(f"reconsidering {chosen.names[0]} beside the others")
        step = _reconsider(problem, chosen)
        rounds.append(step)
        chosen = problem.best_inside(sorted([chosen, *step.hypotheses], key=lambda w: w.bic), base)
        chosen = without_unspecific(problem, without_redundant(problem, chosen, base, rounds=rounds), rounds)
    return Selection(base, tuple(rounds), chosen)


def _one_by_one(
    problem: Problem, base: FittedHypothesis, progress: Callable[[str], None]
) -> tuple[FittedHypothesis, list[Round]]:
    """The set to which effects were added one after the other, and the rounds in which they were."""
    rounds, chosen = list[Round](), base

    def passing(step: Round) -> list[FittedHypothesis]:
        return [w for w in step.hypotheses if problem.passes(w, chosen) and problem.adds_enough(w, chosen, base)]

    while problem.has_room(chosen):
        progress(f"weighing what to add to {', '.join(chosen.names) or 'the refit'}")
        rounds.append(problem.add_to(chosen, rounds))
        if not passing(rounds[-1]) and (late := problem.add_filter(rounds[-1])):
            rounds.append(late)
        better = passing(rounds[-1])
        if not better:
            break
        chosen = problem.best_inside(better, chosen)
    if not rounds:  # what the recordings could show is asked of the first round
        rounds.append(Round(base, score_candidates(problem.data, base.fit, problem.candidates), []))
    return chosen, rounds


def _reconsider(problem: Problem, chosen: FittedHypothesis) -> Round:
    """Fit what could stand in the place of the effect that was chosen first."""
    first, *rest = chosen.candidates
    base = problem.fit(chosen.fit.model.put(first.none), rest, _BASE_ROUNDS)
    return problem.reconsider(base, first)
