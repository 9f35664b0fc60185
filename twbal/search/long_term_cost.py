"""Expected long-term cost of a policy on the model, and its gradient (eq. 9, 12-17)."""

from typing import NamedTuple

import numpy as np

from twbal.core.compiled import kernel
from twbal.core.cost import Cost, CostNumbers, expected_price
from twbal.core.gaussian import Gaussian
from twbal.models.moments.truncation import EXACT, Series, Truncation, series
from twbal.policies.rbf import RbfPolicy
from twbal.policies.rbf_moments import Network
from twbal.search.transition import ForwardStep, PolicyGradient, TransitionModel, step_backward, step_forward


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
) -> list[ForwardStep]:
    """Steps of the closed loop in distribution from N(x_0), `horizon` of them."""
    steps: list[ForwardStep] = []
    network, cut = policy.network, series(truncation, len(model.inputs))
    state, degree = _plain(start), 0
    for _ in range(horizon):
        steps.append(step_forward(model, network, state, cut, degree))
        degree = steps[-1].prediction.enough  # the next distribution is much like this one
        state = steps[-1].next_state
    return steps


def long_term_cost(
    model: TransitionModel,
    policy: RbfPolicy,
    cost: Cost,
    start: Gaussian,
    horizon: int,
    truncation: Truncation,
    gradient: bool = True,
) -> LongTermCost:
    """J and, where asked, dJ/dψ: one pass forward and one back, `horizon` steps each.

    Compiled as a whole, and free of Python's lock: several can run at once in threads.

    Raises:
        numpy.linalg.LinAlgError: a state's covariance is no longer finite.
    """
    cut = series(truncation, len(model.inputs))
    return _long_term_cost(model, policy.network, cost.numbers, _plain(start), horizon, cut, gradient)


def _plain(state: Gaussian) -> Gaussian:
    return Gaussian(*(np.ascontiguousarray(part, dtype=np.float64) for part in state))


@kernel()
def _long_term_cost(
    model: TransitionModel,
    network: Network,
    cost: CostNumbers,
    start: Gaussian,
    horizon: int,
    cut: Series,
    gradient: bool,
) -> LongTermCost:
    steps, costs = [], []
    state, value, exact_steps = start, 0.0, 0
    degree = int(np.int64(0))  # a bare 0 is a type of its own to numba, and all would be compiled twice
    for _ in range(horizon):
        step = step_forward(model, network, state, cut, degree)
        state, degree = step.next_state, step.prediction.enough
        price = expected_price(cost, state.mean, state.covariance)
        steps.append(step)
        costs.append(price)
        value += price.value
        exact_steps += step.prediction.degree == EXACT

    D = len(start.mean)
    by_mean, by_covariance = np.zeros(D), np.zeros((D, D))
    centres, weights = np.zeros_like(network.centres), np.zeros_like(network.weights)
    lengths, gain = np.zeros(D), np.zeros(D)
    if gradient:
        for t in range(horizon - 1, -1, -1):
            by_mean, by_covariance, through = step_backward(
                model,
                network,
                steps[t],
                cut.indices,
                by_mean + costs[t].by_mean,
                by_covariance + costs[t].by_covariance,
            )
            centres += through.centres
            weights += through.weights
            lengths += through.lengths
            gain += through.gain
    return LongTermCost(value, PolicyGradient(centres, weights, lengths, gain), exact_steps)


def machine_code_folder() -> str:
    """Where the machine code of all this is kept."""
    return str(_long_term_cost.stats.cache_path)  # type: ignore[attr-defined]
