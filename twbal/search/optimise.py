"""Lines 3 and 8 of Algorithm 1: the policy that is best on the model."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from twbal.cost import SaturatingCost
from twbal.errors import SearchError
from twbal.gaussian import Array, Gaussian
from twbal.models.dynamics import DynamicsModel
from twbal.models.moments.prediction import DEGREES, Truncation
from twbal.policies.rbf import RbfPolicy
from twbal.search.descent import Minimised, Objective, descend
from twbal.search.judgement import Judge, Judgement, judge
from twbal.search.long_term_cost import propagate
from twbal.search.particles import ParticleObjective
from twbal.search.starts import PolicyShape, Start, starting_policies, starts_on
from twbal.search.transition import TransitionModel, transition_model


@dataclass(frozen=True)
class SearchSettings:
    """How to search.

    Attributes:
        horizon: H [control periods].
        short_horizon: of the first part of each search; a long one has no slope on the plateau of a policy that falls.
        iterations: of L-BFGS over the whole horizon, at most.
        short_iterations: of L-BFGS over the short one, at most.
        searched: how many starts, the best over the short horizon, are searched; 0 only judges earlier policies.
        long_horizon: over which the search goes on from the best that it found where less than `content` of the judge's
            robots balance under any candidate: a robot that slowly runs away is cheap over a short horizon.
        long_iterations: of L-BFGS over that, at most.
        content: share of the judge's robots.
        swings: see `starting_policies`.
        command_widths: see `starting_policies`.
        shares: see `starting_policies`.
        weight_penalty: see `Objective`.
        particles: by which costs are found instead of moment matching (`ParticleObjective`); 0: by moment matching.
        tolerance: see `Truncation`; while searching.
        degrees: see `Truncation`; while searching.
    """

    horizon: int
    short_horizon: int
    iterations: int
    short_iterations: int
    searched: int
    long_horizon: int
    long_iterations: int
    content: float
    swings: tuple[float, ...]
    command_widths: tuple[float, ...]
    shares: tuple[float, ...]
    weight_penalty: float
    particles: int
    tolerance: float
    degrees: tuple[int, ...]


class Candidate(NamedTuple):
    """A policy that was considered.

    Attributes:
        origin: where its search began, or which earlier policy it is.
        policy: the policy.
        cost: expected long-term cost over the horizon.
        judgement: of its long rollouts.
    """

    origin: str
    policy: RbfPolicy
    cost: float
    judgement: Judgement


class SearchResult(NamedTuple):
    """What a search found.

    Attributes:
        best: the candidate that the long rollouts say is best.
        candidates: all that were judged, best first.
        predicted: (H + 1) distributions of the state under the best policy, t = 0..H, as the sensors show them.
    """

    best: Candidate
    candidates: tuple[Candidate, ...]
    predicted: tuple[Gaussian, ...]


def search_policy(
    model: DynamicsModel,
    start: Gaussian,
    cost: SaturatingCost,
    shape: PolicyShape,
    torque_limit: float,
    settings: SearchSettings,
    judging: Judge,
    earlier: Sequence[RbfPolicy],
    seed: int,
    progress: Callable[[str], None],
    workers: int = 1,
    base: Array | None = None,
) -> SearchResult:
    """Search from the most promising starts, judge what was found on long rollouts, and return the best.

    Earlier policies are judged beside the new ones, so that a search that only made things worse shows. One that was
    chosen twice already is none of them: what it does the model has been told, and a third time would teach nothing.

    Args:
        start: distribution of x_0.
        earlier: policies of earlier iterations, oldest first.
        progress: is told what is being done, a line at a time.
        workers: threads that search beside each other; what is found does not depend on it.
        base: (D,) gain K of a regulator u = -Kx that stays as it is, while the network on top of it is searched; None
            searches all.

    Raises:
        SearchError: no start has a finite cost on this model.
    """
    rng = np.random.default_rng(seed)
    dynamics = transition_model(model)
    scales = shape.scales(model.channels.names, torque_limit)
    searching = Truncation(settings.tolerance, tuple(settings.degrees), fall_back=False)

    def objective(horizon: int) -> Minimised:
        if settings.particles:
            count, penalty = settings.particles, settings.weight_penalty
            return ParticleObjective(model, cost, start, horizon, count, judging.features, seed, penalty)
        return Objective(dynamics, cost, start, horizon, searching, settings.weight_penalty)

    short, whole = objective(settings.short_horizon), objective(settings.horizon)
    linear = shape.linear and base is None

    def searched(chosen: Start) -> RbfPolicy:
        found = descend(short, chosen.policy, scales, linear, settings.short_iterations)
        return descend(whole, found, scales, linear, settings.iterations)

    chosen: list[Start] = []
    if settings.searched or not earlier:
        starts = (
            _usual_starts(model, shape, cost, torque_limit, settings, earlier, rng)
            if base is None
            else starts_on(base, model.channels.names, shape, torque_limit, earlier, rng)
        )
        chosen = _promising(starts, short, max(settings.searched, 1), workers)

    def judged(origin: str, policy: RbfPolicy) -> Candidate:
        judgement = judge(model, policy, cost, start, judging, seed)
        candidate = Candidate(origin, policy, whole.value(policy), judgement)
        progress(f"{origin}: cost {candidate.cost:.2f}, {judgement.success:.0%} of the long rollouts balance")
        return candidate

    fresh = _not_driven_twice(earlier) if settings.searched else range(len(earlier))
    candidates = [judged(f"policy {i}", earlier[i]) for i in fresh]
    with ThreadPoolExecutor(workers) as pool:
        for each, found in zip(chosen, pool.map(searched, chosen), strict=True):
            candidates.append(judged(f"search from {each.origin}", found))
    candidates.sort(key=_rank)
    if chosen and candidates[0].judgement.success < settings.content:
        patient = objective(settings.long_horizon)
        near = next(c for c in candidates if c.origin.startswith("search"))
        found = descend(patient, near.policy, scales, linear, settings.long_iterations)
        candidates.append(judged(f"long {near.origin}", found))
        candidates.sort(key=_rank)
    best = candidates[0]
    return SearchResult(best, tuple(candidates), _bands(whole, dynamics, best.policy, start, settings))


def _usual_starts(
    model: DynamicsModel,
    shape: PolicyShape,
    cost: SaturatingCost,
    torque_limit: float,
    settings: SearchSettings,
    earlier: Sequence[RbfPolicy],
    rng: np.random.Generator,
) -> list[Start]:
    swings, widths = settings.swings, settings.command_widths
    return starting_policies(model, shape, cost, torque_limit, swings, widths, earlier, settings.shares, rng)


def _not_driven_twice(earlier: Sequence[RbfPolicy]) -> list[int]:
    """Indices of the first of each policy that is among `earlier` but once."""
    keys = [tuple(part.tobytes() for part in (p.centres, p.weights, p.lengths, p.gain)) for p in earlier]
    return [i for i, key in enumerate(keys) if keys.count(key) == 1]


def _rank(candidate: Candidate) -> tuple[float, float]:
    """Less is better: success in tenths, then the judge's cost."""
    return -round(candidate.judgement.success, 1), candidate.judgement.cost


def _bands(
    objective: Minimised, dynamics: TransitionModel, policy: RbfPolicy, start: Gaussian, settings: SearchSettings
) -> tuple[Gaussian, ...]:
    """Distributions of what the sensors show under a policy, t = 0..H; by longer series than the search takes."""
    if isinstance(objective, ParticleObjective):
        courses = objective.distributions(policy)
    else:
        truncation = Truncation(settings.tolerance, DEGREES, fall_back=False)
        courses = [step.next_state for step in propagate(dynamics, policy, start, settings.horizon, truncation)]
    sensors = np.diag(dynamics.observation_noise)
    return tuple(Gaussian(state.mean, state.covariance + sensors) for state in (start, *courses))


def _promising(starts: Sequence[Start], objective: Minimised, count: int, workers: int) -> list[Start]:
    """The `count` starts with the lowest finite cost, no two from the same family while others are left."""
    with ThreadPoolExecutor(workers) as pool:
        costs = list(pool.map(objective.value, (start.policy for start in starts)))
    _, first_of_cost = np.unique(costs, return_index=True)  # by cost; of equal policies, as iterations may share, one
    order = [int(i) for i in first_of_cost if np.isfinite(costs[i])]
    if not order:
        raise SearchError(
            f"None of {len(starts)} starting policies has a finite cost on this model. It was probably learned from "
            "too few or too wild samples: record another rollout, or fit again."
        )
    families = [starts[i].origin.split(" x ")[0].split(" (")[0] for i in order]
    first = [i for place, i in enumerate(order) if families[place] not in families[:place]]
    rest = [i for i in order if i not in first]
    return [starts[i] for i in (first + rest)[:count]]
