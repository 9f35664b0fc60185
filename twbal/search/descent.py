"""L-BFGS on the expected long-term cost."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import scipy.optimize

from twbal.core.cost import Cost
from twbal.core.gaussian import Array, Gaussian
from twbal.models.moments.truncation import Truncation
from twbal.policies.rbf import RbfPolicy
from twbal.search.long_term_cost import LongTermCost, long_term_cost
from twbal.search.transition import PolicyGradient, TransitionModel

_WORSE_THAN_ALL = 1e10
"""Stands for a cost that is not finite: the line search steps back from it."""


@dataclass(frozen=True)
class Objective:
    """What is minimised: the long-term cost on `model` over `horizon` steps, and a little of the weights' size.

    Attributes:
        model: of the dynamics.
        cost: of a state.
        start: distribution of the first state.
        horizon: steps.
        truncation: of the moment matching.
        weight_penalty: on Σ w²; keeps basis functions from cancelling each other.
    """

    model: TransitionModel
    cost: Cost
    start: Gaussian
    horizon: int
    truncation: Truncation
    weight_penalty: float

    def value(self, policy: RbfPolicy) -> float:
        """The long-term cost alone; infinite where it cannot be computed."""
        found = self.cost_of(policy, gradient=False)
        return found.value if found and np.isfinite(found.value) else np.inf

    def cost_of(self, policy: RbfPolicy, gradient: bool) -> LongTermCost | None:
        """The long-term cost without the penalty; None where a covariance on the way is not one."""
        try:
            return long_term_cost(
                self.model, policy, self.cost, self.start, self.horizon, self.truncation, gradient=gradient
            )
        except np.linalg.LinAlgError:
            return None


class Minimised(Protocol):
    """What `descend` needs of an objective; see `Objective`."""

    @property
    def weight_penalty(self) -> float:
        """On Σ w²."""

    def value(self, policy: RbfPolicy) -> float:
        """The cost alone; infinite where it cannot be computed."""

    def cost_of(self, policy: RbfPolicy, gradient: bool) -> LongTermCost | None:
        """The cost with its gradient."""


@dataclass(frozen=True)
class MeanObjective:
    """What is minimised where one policy is to serve several models, each as likely: the mean of their costs.

    Attributes:
        parts: the objective on each model.
    """

    parts: Sequence[Minimised]

    @property
    def weight_penalty(self) -> float:
        """On Σ w²; the same in all parts."""
        return self.parts[0].weight_penalty

    def value(self, policy: RbfPolicy) -> float:
        """The mean cost alone; infinite where one cannot be computed."""
        return float(np.mean([part.value(policy) for part in self.parts]))

    def cost_of(self, policy: RbfPolicy, gradient: bool) -> LongTermCost | None:
        """The mean cost with its gradient; None where one has none."""
        found = [part.cost_of(policy, gradient) for part in self.parts]
        costs = [cost for cost in found if cost is not None]
        if len(costs) < len(found):
            return None
        slopes = zip(*(cost.gradient for cost in costs), strict=True)
        return LongTermCost(
            float(np.mean([cost.value for cost in costs])),
            PolicyGradient(*(np.mean(parts, axis=0) for parts in slopes)),
            sum(cost.exact_steps for cost in costs),
        )


def descend(objective: Minimised, policy: RbfPolicy, scales: Array, linear: bool, iterations: int) -> RbfPolicy:
    """The policy after at most `iterations` of L-BFGS from `policy`; never one with a higher objective.

    Parameters are searched in units of the channels' scales, length-scales by their logarithms.

    Args:
        scales: (D,) of the channels.
        linear: search the linear gain too; otherwise it stays as it is.
        iterations: at most.
    """
    frame = _Frame(policy, scales, linear)

    def function(vector: Array) -> tuple[float, Array]:
        candidate = frame.policy(vector)
        nowhere = np.zeros_like(vector)
        found = objective.cost_of(candidate, gradient=True)
        if found is None:
            return _WORSE_THAN_ALL, nowhere
        weights = candidate.weights
        found_gradient = found.gradient._replace(
            weights=found.gradient.weights + 2.0 * objective.weight_penalty * weights
        )
        gradient = frame.gradient(candidate, found_gradient)
        value = found.value + objective.weight_penalty * float(weights @ weights)
        if not (np.isfinite(value) and np.isfinite(gradient).all()):
            return _WORSE_THAN_ALL, nowhere
        return value, gradient

    options = {"maxiter": iterations, "maxfun": 3 * iterations // 2}
    result = scipy.optimize.minimize(function, frame.vector, jac=True, method="L-BFGS-B", options=options)
    return frame.policy(result.x)


class _Frame:
    """A policy's parameters as one vector of unit-free numbers, and back."""

    def __init__(self, policy: RbfPolicy, scales: Array, linear: bool) -> None:
        self._policy, self._scales, self._linear = policy, scales, linear
        parts = [(policy.centres / scales).ravel(), policy.weights, np.log(policy.lengths / scales)]
        if linear:
            parts.append(policy.gain * scales)
        self.vector = np.concatenate(parts)

    def policy(self, vector: Array) -> RbfPolicy:
        """The policy that `vector` stands for."""
        N, D = self._policy.centres.shape
        centres, weights, logs, gain = np.split(vector, [N * D, N * D + N, N * D + N + D])
        return replace(
            self._policy,
            centres=centres.reshape(N, D) * self._scales,
            weights=weights,
            lengths=np.exp(np.clip(logs, -8.0, 8.0)) * self._scales,
            gain=gain / self._scales if self._linear else self._policy.gain,
        )

    def gradient(self, policy: RbfPolicy, gradient: PolicyGradient) -> Array:
        """The gradient by the policy's parameters as one by the vector."""
        parts = [(gradient.centres * self._scales).ravel(), gradient.weights, gradient.lengths * policy.lengths]
        if self._linear:
            parts.append(gradient.gain / self._scales)
        return np.concatenate(parts)
