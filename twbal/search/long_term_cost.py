"""Expected long-term cost of a policy on the model, and its gradient (eq. 9, 12-17)."""

from typing import NamedTuple

import numpy as np

from twbal.cost import SaturatingCost
from twbal.gaussian import Array, Gaussian
from twbal.models.moments.prediction import EXACT, Truncation
from twbal.policies.rbf import RbfPolicy
from twbal.search.transition import PolicyGradient, Step, TransitionModel, step_backward, step_forward


class LongTermCost(NamedTuple):
    """J = Σ_{t=1}^{H} E[c(x_t)] (eq. 9; c(x_0) does not depend on the policy).

    Attributes:
        value: in [0, H].
        gradient: by the policy's parameters (eq. 12); zero where it was not asked for.
        exact_steps: how many of the H steps fell back to sums over pairs.
    """

    value: float
    gradient: PolicyGradient
    exact_steps: int


def propagate(
    model: TransitionModel, policy: RbfPolicy, start: Gaussian, horizon: int, truncation: Truncation
) -> list[Step]:
    """Steps of the closed loop in distribution from N(x_0), `horizon` of them."""
    steps: list[Step] = []
    state, degree = start, 0
    for _ in range(horizon):
        steps.append(step_forward(model, policy, state, truncation, degree))
        degree = steps[-1].prediction.enough  # the next distribution is much like this one
        state = steps[-1].next_state
    return steps


def long_term_cost(
    model: TransitionModel,
    policy: RbfPolicy,
    cost: SaturatingCost,
    start: Gaussian,
    horizon: int,
    truncation: Truncation,
    gradient: bool = True,
) -> LongTermCost:
    """J and, where asked, dJ/dψ: one pass forward and one back."""
    steps = propagate(model, policy, start, horizon, truncation)
    costs = [cost.expected(step.next_state) for step in steps]
    by_mean: Array = np.zeros(len(start.mean))
    by_covariance: Array = np.zeros((len(start.mean),) * 2)
    total = PolicyGradient(
        np.zeros_like(policy.centres),
        np.zeros_like(policy.weights),
        np.zeros_like(policy.lengths),
        np.zeros_like(policy.gain),
    )
    for step, here in zip(reversed(steps), reversed(costs), strict=True) if gradient else ():
        by_mean, by_covariance, through = step_backward(
            model, policy, step, by_mean + here.by_mean, by_covariance + here.by_covariance
        )
        total = PolicyGradient(*(a + b for a, b in zip(total, through, strict=True)))
    exact_steps = sum(step.prediction.degree == EXACT for step in steps)
    return LongTermCost(sum(c.value for c in costs), total, exact_steps)
