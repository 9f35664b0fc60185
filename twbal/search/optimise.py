"""Lines 3 and 8 of Algorithm 1: the policy that is best on the model."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from twbal.core.errors import SearchError
from twbal.core.gaussian import Array
from twbal.core.streams import Stream, generator
from twbal.core.threads import in_threads
from twbal.policies.linear import LinearPolicy
from twbal.policies.rbf import RbfPolicy
from twbal.search.descent import Minimised, descend
from twbal.search.predicted_rollout import PredictedRollout
from twbal.search.robust import RankedPolicy, SampledRobots
from twbal.search.starts import (
    PolicyParametrisation,
    Start,
    earlier_start,
    robust_start,
    starting_policies,
    starts_on,
)
from twbal.search.task import PolicyCandidate, Task

_MOST, _LEAST_KEPT = 0.5, 0.5  # of the robots; a search that keeps less of them over the short horizon ends there


class _Judged(NamedTuple):
    """A policy that is to be judged; see `PolicyCandidate`."""

    origin: str
    policy: RbfPolicy
    earlier: int | None = None


class SearchResult(NamedTuple):
    """What a search found.

    Attributes:
        best: the candidate that the long rollouts say is best.
        candidates: all that were judged, best first.
        predictions: of rollouts under the best policy, by robots of the parameter distribution and by the models; the
            first is the one to take, and alone where they are not to be compared.
    """

    best: PolicyCandidate
    candidates: tuple[PolicyCandidate, ...]
    predictions: tuple[PredictedRollout, ...]


def search_policy(
    task: Task,
    shape: PolicyParametrisation,
    torque_limit: float,
    earlier: Sequence[RbfPolicy],
    progress: Callable[[str], None],
    workers: int = 1,
    base: LinearPolicy | None = None,
    are_robots_new: bool = True,
    set_aside: Sequence[int] = (),
) -> SearchResult:
    """Search from the most promising starts, judge what was found on long rollouts, and return the best.

    Where robots of the parameter distribution are given, the start is the regulator that holds most of them; it is
    judged, too. Where the newest earlier policy was searched for the same robots, that is the start.

    Earlier policies are judged beside the new ones, so that a search that only made things worse shows. None is that
    was chosen twice already: what it does the model has been told, and a third time would teach nothing.

    Args:
        task: what the policy is for.
        shape: of the policy.
        torque_limit: [N·m].
        earlier: policies of earlier iterations, oldest first.
        progress: is told what is being done, a line at a time.
        workers: threads that search, and as many that judge meanwhile; what is found does not depend on it.
        base: fixed regulator, on top of which a network is searched; None searches all.
        are_robots_new: whether the robots of the parameter distribution are others than those of the earlier policies.
        set_aside: indices of earlier policies that are no candidates, and from which no search begins.

    Raises:
        SearchError: no start has a finite cost on this model.
    """
    settings, linear = task.settings, shape.linear and base is None
    scales = shape.scales(task.models[0].names, torque_limit)
    short = task.objective(settings.short_horizon)
    robust, chosen = list[RankedPolicy](), list[Start]()
    begin = [policy for i, policy in enumerate(earlier) if i not in set_aside]
    searches_anew = settings.restarts > 0 or not earlier
    if searches_anew and linear and task.robots is not None:
        robust, chosen = _robust_starts(task.robots, task.seed, shape, () if are_robots_new else begin, workers)
    if searches_anew and not (robust or chosen):
        chosen = _promising(_starts(task, shape, torque_limit, begin, base), short, max(settings.restarts, 1), workers)

    def shown(found: PolicyCandidate) -> PolicyCandidate:
        progress(_in_words(found))
        return found

    fresh = _not_driven_twice(earlier) if settings.restarts else range(len(earlier))
    judged = [_Judged(f"policy {i}", earlier[i], i) for i in fresh if i not in set_aside]
    judged += [_Judged(found.origin, found.policy) for found in robust]
    with ThreadPoolExecutor(workers) as pool:
        begun = [pool.submit(_searched, task, short, each, scales, linear) for each in chosen]
        with ThreadPoolExecutor(workers) as judges:  # meanwhile
            candidates = [shown(found) for found in judges.map(lambda each: task.validated(*each), judged)]
        leading = min(candidates, key=_rank) if task.robots is not None and candidates else None
        prediction = None if leading is None else task.prediction(leading)  # mostly it stays the best
        for each, search in zip(chosen, begun, strict=True):
            candidates.append(shown(task.validated(f"search from {each.origin}", search.result())))
    candidates.sort(key=_rank)
    if chosen and task.robots is None and candidates[0].validation.success < settings.min_success_rate:
        long = shown(task.validated(*_searched_long(task, candidates, scales, linear)))
        candidates = sorted([*candidates, long], key=_rank)
    best = candidates[0]
    predicted = prediction if prediction is not None and best is leading else task.prediction(best)
    return SearchResult(best, tuple(candidates), (predicted,))


def judge_policy(task: Task, policy: RbfPolicy, progress: Callable[[str], None], workers: int = 1) -> SearchResult:
    """One earlier policy, without a search: judged, and predicted in all ways, for rollouts to tell which is the best.

    Args:
        task: what the policy is for.
        policy: it.
        progress: is told how the policy was judged.
        workers: threads; what is found does not depend on it.
    """
    found, predictions = task.judged("policy 0", policy, 0, workers)
    progress(_in_words(found))
    return SearchResult(found, (found,), predictions)


def _in_words(found: PolicyCandidate) -> str:
    """How a candidate was judged: by sampled robots, which decide, and by the learned model."""
    whose = "robots sampled from the learned model" if found.robots is None else "sampled robots"
    margin = None if found.robots is None else found.robots.margin
    changed = "" if margin is None else f", and {margin:.0%} of as many that changed"
    return (
        f"{found.origin}: {found.judged.success:.0%} of {found.sampled} {whose} succeed{changed}; the learned model "
        f"expects a cost of {found.cost:.2f}"
    )


def _searched(task: Task, short: Minimised, start: Start, scales: Array, linear: bool) -> RbfPolicy:
    """What a search from a start finds: over the short horizon, whose objective is `short`, then over the whole one."""
    found = descend(short, start.policy, scales, linear, task.settings.short_iterations)
    if task.robots is not None and _loses_robots(task.robots, start.policy, found):
        return found
    return descend(task.whole, found, scales, linear, task.settings.iterations)


def _searched_long(
    task: Task, candidates: Sequence[PolicyCandidate], scales: Array, linear: bool
) -> tuple[str, RbfPolicy]:
    """The best of the new candidates, searched on over the long horizon, and what it is called."""
    near, settings = next(c for c in candidates if c.earlier is None), task.settings
    long = task.objective(settings.long_horizon)
    return f"long {near.origin}", descend(long, near.policy, scales, linear, settings.long_iterations)


def _robust_starts(
    robots: SampledRobots, seed: int, shape: PolicyParametrisation, same: Sequence[RbfPolicy], workers: int
) -> tuple[list[RankedPolicy], list[Start]]:
    """The regulator that holds most robots, and the start that it is; of `same` robots' policies the newest instead.

    Where policies are to balance robots that change, too, it is no start: models know no such robots, and in the
    updates of 64 robots a search from it found no policy that ranked first.
    """
    if same:
        return [], [earlier_start(same)]
    found = robots.regulators(workers)[:1]
    return found, [] if robots.with_margin else [robust_start(shape, each, seed) for each in found]


def _loses_robots(robots: SampledRobots, start: RbfPolicy, found: RbfPolicy) -> bool:
    """Whether the robot is known by rollouts, and of most robots like it that succeed under a start half no longer do.

    The models then know something else than the robots, by which policies are ranked.
    """
    if not robots.are_measured:
        return False
    before = robots.driven(start).success
    return before >= _MOST and robots.driven(found).success < _LEAST_KEPT * before


def _starts(
    task: Task,
    shape: PolicyParametrisation,
    torque_limit: float,
    earlier: Sequence[RbfPolicy],
    base: LinearPolicy | None,
) -> list[Start]:
    rng = generator(Stream.SEARCH_STARTS, task.seed)
    if base is None:
        return starting_policies(task, shape, torque_limit, earlier, rng)
    return starts_on(base, task.models[0].names, shape, torque_limit, earlier, rng)


def _not_driven_twice(earlier: Sequence[RbfPolicy]) -> list[int]:
    """Indices of the first of each policy that is among `earlier` but once."""
    keys = [
        tuple(np.asarray(part).tobytes() for name, part in vars(policy).items() if name != "channels")
        for policy in earlier
    ]
    return [i for i, key in enumerate(keys) if keys.count(key) == 1]


def _rank(candidate: PolicyCandidate) -> tuple[float, ...]:
    """Less is better: success in tenths, then the sampled cost; what is not a number comes last.

    Where there are robots of the parameter distribution, they decide, and among policies that hold as many, how they
    do.
    """
    if candidate.robots is not None:
        return candidate.robots.rank
    success, cost = candidate.validation
    return (-round(success, 1), cost) if np.isfinite([success, cost]).all() else (np.inf, np.inf)


def _promising(starts: Sequence[Start], objective: Minimised, count: int, workers: int) -> list[Start]:
    """The `count` starts with the lowest finite cost, no two from the same family while others are left; of none, none.

    Raises:
        SearchError: no start has a finite cost.
    """
    if not starts:
        return []
    costs = in_threads(objective.value, [start.policy for start in starts], workers)
    _, first_of_cost = np.unique(costs, return_index=True)  # by cost; of equal policies, as iterations may share, one
    order = [int(i) for i in first_of_cost if np.isfinite(costs[i])]
    if not order:
        raise SearchError(
            f"None of {len(starts)} starting policies has a finite cost on this model. It was probably learned from "
            "too few or too wild samples: record another rollout, or fit again."
        )
    families = [starts[i].family for i in order]
    first = [i for place, i in enumerate(order) if families[place] not in families[:place]]
    rest = [i for i in order if i not in first]
    return [starts[i] for i in (first + rest)[:count]]
