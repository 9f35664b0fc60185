"""Predicted rollouts under a policy: by the model f + g, or by robots of the parameter distribution.

f + g is smooth where a dead zone and dry friction are not, so of a policy that keeps a robot nearly still it may expect
falls that do not come. Robots that are drawn from the distribution of the parameters have these effects, but nothing
that no parameter describes, and the search drives them more cautiously than is likely: under slow torques that rollouts
are too short to tell. Which prediction knows the robot best is told by rollouts of that very policy, by a proper score.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from math import inf
from typing import NamedTuple

import numpy as np

from twbal.core.cost import Cost
from twbal.core.episode import Episode
from twbal.core.gaussian import Array, Gaussian
from twbal.core.scores import scores
from twbal.policies.rbf import RbfPolicy
from twbal.search.predictor import Predictor
from twbal.search.robust import SampledRobots

_FEWEST = 3  # robots that have a mean and a covariance
_SPREADS = (1.0, 0.0)  # factors on the deviations of the robots' parameters from their means
_TORQUES = (1.0, 0.5, 0.25)  # factors on the slow torques


class PredictedRollout(NamedTuple):
    """The distribution of rollouts under a policy.

    Attributes:
        by: what predicts.
        cost: expected long-term cost over H control periods (eq. 9), from 0 to H.
        states: (H + 1) distributions of the state, t = 0..H, as the sensors show them.
        crps: of the states on rollouts of the policy (`scores`); None where there were none to score it on.
        detail: how robots were drawn, where not as for the search, in words.
        unknown: (H + 1, D), how much of the states' variances is due to what is not known of the robot; the rest varies
            from rollout to rollout. None where that is not told.
    """

    by: Predictor
    cost: float
    states: tuple[Gaussian, ...]
    crps: float | None = None
    detail: str = ""
    unknown: Array | None = None


def predicted_by_robots(robots: SampledRobots, policy: RbfPolicy, horizon: int) -> Iterator[PredictedRollout]:
    """What robots of the parameter distribution do under a policy, by Monte Carlo; first as the search drives them.

    The further ones have the mean parameters instead of drawn ones, or a share of the slow torques, or both.

    The states at a step are those of the robots that still stand, as `coverage95` and `scores` compare trials as far as
    they went; a robot that fell costs 1 a step. Once fewer than three stand, the states stay as they were.

    Args:
        robots: drawn from what is known of the robot.
        policy: drives them.
        horizon: H [control periods].

    Yields:
        Those under which three robots at least take the first step; each is computed when it is asked for.
    """
    for spread, torques in product(_SPREADS, _TORQUES):
        found = _predicted(_varied(robots, spread, torques), policy, horizon, _in_words(spread, torques))
        if found is not None:
            yield found


def ranked_by_crps(
    predictions: Sequence[PredictedRollout], episodes: Sequence[Episode], measured: Sequence[int], scales: Array
) -> tuple[PredictedRollout, ...]:
    """Predictions with their CRPS on rollouts of the policy, the lowest first; where none can be scored, as they are.

    Args:
        predictions: of one policy, of D channels.
        episodes: rollouts of that policy.
        measured: channels to score.
        scales: (D,) units in which channels are compared; see `scores`.

    Raises:
        DataError: the episodes have other channels, or none reached the first step.
    """
    found = [scores(each.states, episodes, measured, scales) for each in predictions]
    scored = [each._replace(crps=f.crps if f else None) for each, f in zip(predictions, found, strict=True)]
    return tuple(sorted(scored, key=lambda each: inf if each.crps is None else each.crps))


def _varied(robots: SampledRobots, spread: float, torques: float) -> SampledRobots:
    """The robots with other deviations from the mean parameters, and other slow torques, by factors."""
    known = replace(robots.distribution, torque_sd=torques * robots.distribution.torque_sd)
    return replace(robots, distribution=known, settings=replace(robots.settings, doubt=spread * robots.settings.doubt))


def _in_words(spread: float, torques: float) -> str:
    parameters = "" if spread else "mean parameters"
    return ", ".join(filter(None, (parameters, "" if torques == 1.0 else f"slow torques x {torques:g}")))


def _predicted(robots: SampledRobots, policy: RbfPolicy, horizon: int, detail: str) -> PredictedRollout | None:
    shown = robots.states(policy, horizon)  # (n, H + 1, D), NaN after a fall
    is_there = ~np.isnan(shown[..., 0])
    if is_there[:, min(1, horizon)].sum() < _FEWEST:
        return None
    states: list[Gaussian] = []
    for seen, there in zip(shown.swapaxes(0, 1), is_there.T, strict=True):
        states.append(_distribution(seen[there]) if there.sum() >= _FEWEST else states[-1])
    cost = _mean_cost(robots.cost, shown[:, 1:], is_there[:, 1:])
    unknown = _unknown(shown, robots.states(policy, horizon, again=True), states)
    return PredictedRollout(Predictor.ROBOTS, cost, tuple(states), detail=detail, unknown=unknown)


def _unknown(shown: Array, again: Array, states: Sequence[Gaussian]) -> Array:
    """How much of the variances of states is due to the robots' parameters, (H + 1, D).

    By the law of total variance that is the variance of a robot's mean. Two rollouts of one robot share nothing but the
    robot (with its tilt filter and the age of its wheel rates), so it is their covariance (I. M. Sobol, Mathematical
    Modelling and Computational Experiments 1(4), 1993, 407-414).

    Args:
        shown: (n, H + 1, D), rollouts of n robots.
        again: the same, other rollouts of the same robots.
        states: their distributions at each step.
    """
    both = np.isfinite(shown[..., :1]) & np.isfinite(again[..., :1])  # (n, H + 1, 1)
    count = np.maximum(both.sum(axis=0), 1)
    first, second = np.where(both, shown, 0.0), np.where(both, again, 0.0)
    covariance: Array = (first * second).sum(axis=0) / count - first.sum(axis=0) * second.sum(axis=0) / count**2
    return np.clip(covariance, 0.0, np.array([state.sd**2 for state in states]))


def _distribution(states: Array) -> Gaussian:
    """Mean and covariance of states (n, D)."""
    return Gaussian(states.mean(axis=0), np.cov(states.T))


def _mean_cost(cost: Cost, states: Array, is_there: Array) -> float:
    """Mean over robots of the sum over H steps of the cost of states (n, H, D), 1 where they are not there."""
    costs = np.ones(is_there.shape)
    costs[is_there] = cost(states[is_there])
    return float(costs.sum(axis=1).mean())
