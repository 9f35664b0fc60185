"""What a policy is searched for: the models that it is to serve, what states cost, and what is made of them."""

import math
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from twbal.core.cost import Cost
from twbal.core.errors import ConfigError
from twbal.core.gaussian import Gaussian, moment_matched_mixture
from twbal.models.dynamics import DynamicsModel
from twbal.models.moments.truncation import Truncation
from twbal.policies.rbf import RbfPolicy
from twbal.search.descent import MeanObjective, Minimised, Objective
from twbal.search.long_term_cost import propagate
from twbal.search.predicted_rollout import PredictedRollout, predicted_by_robots
from twbal.search.predictor import Predictor
from twbal.search.reliability import AS_IT_IS, success_probability
from twbal.search.robust import RankedPolicy, SampledRobots
from twbal.search.transition import TransitionModel, transition_model
from twbal.search.validation import Validation, ValidationResult, validate

if TYPE_CHECKING:
    from twbal.search.particles import ParticleObjective


@dataclass(frozen=True)
class SearchSettings:
    """How to search.

    Attributes:
        horizon: H [control periods].
        short_horizon: of the first part of each search; a long one has no slope on the plateau of a policy that falls.
        iterations: of L-BFGS over the whole horizon, at most.
        short_iterations: of L-BFGS over the short one, at most.
        restarts: how many starts, the best over the short horizon, are searched; 0 only judges earlier policies.
        long_horizon: over which the search goes on from the best that it found where less than `min_success_rate` of
            the sampled robots balance under any candidate: a robot that slowly runs away is cheap over a short horizon.
        long_iterations: of L-BFGS over that, at most.
        min_success_rate: share of the sampled robots.
        linearisation_amplitudes: see `starting_policies`.
        lqr_command_widths: see `starting_policies`.
        gain_scales: see `starting_policies`.
        weight_penalty: see `Objective`.
        particles: by which costs are found instead of moment matching (`ParticleObjective`); 0: by moment matching.
        tolerance: see `Truncation`; while searching.
        degrees: see `Truncation`; while searching.
    """

    horizon: int
    short_horizon: int
    iterations: int
    short_iterations: int
    restarts: int
    long_horizon: int
    long_iterations: int
    min_success_rate: float
    linearisation_amplitudes: tuple[float, ...]
    lqr_command_widths: tuple[float, ...]
    gain_scales: tuple[float, ...]
    weight_penalty: float
    particles: int
    tolerance: float
    degrees: tuple[int, ...]

    def __post_init__(self) -> None:
        if self.particles == 1:
            raise ConfigError("search.particles must be 0 or at least 2, as one particle has no spread; found 1.")
        if list(self.degrees) != sorted(set(self.degrees)):
            raise ConfigError(f"search.degrees must rise from degree to degree; found {list(self.degrees)}.")


class PolicyCandidate(NamedTuple):
    """A policy that was considered.

    Attributes:
        origin: where its search began, or which earlier policy it is.
        policy: the policy.
        cost: expected long-term cost over the horizon.
        validation: of its long rollouts.
        earlier: which of the given earlier policies it is; None for what was searched.
        robots: of its long rollouts on robots of the parameter distribution; None where there are none.
        sampled: how many robots `judged` counts; 0: not told.
        reliability: of the probability of success; see `success_probability`.
    """

    origin: str
    policy: RbfPolicy
    cost: float
    validation: ValidationResult
    earlier: int | None = None
    robots: RankedPolicy | None = None
    sampled: int = 0
    reliability: tuple[float, float] = AS_IT_IS

    @property
    def success_probability(self) -> float | None:
        """That a trial of it succeeds, by the robots that `judged` counts; None where it is not told how many."""
        return success_probability(self.judged.success, self.sampled, self.reliability) if self.sampled else None

    @property
    def judged(self) -> ValidationResult:
        """What decides first: robots of the parameter distribution, where there are some, else the sampled f + g."""
        return self.validation if self.robots is None else ValidationResult(self.robots.success, self.robots.cost)


@dataclass(frozen=True)
class Task:
    """What the policy is for; on several models it is to serve them all, each as likely.

    Attributes:
        models: of the dynamics, with the same state; one or more.
        start: distribution of x_0.
        cost: of a state.
        settings: of the search.
        validation: of the long rollouts.
        seed: of all that is drawn.
        robots: of known numbers that it is to hold, too; None: there are none.
    """

    models: Sequence[DynamicsModel]
    start: Gaussian
    cost: Cost
    settings: SearchSettings
    validation: Validation
    seed: int
    robots: SampledRobots | None = None

    @cached_property
    def _transitions(self) -> list[TransitionModel]:
        return [transition_model(model) for model in self.models]

    @cached_property
    def whole(self) -> Minimised:
        """The objective over the whole horizon, by which candidates are told apart."""
        return self.objective(self.settings.horizon)

    def objective(self, horizon: int) -> Minimised:
        """What is minimised: the mean of the long-term costs over `horizon`."""
        return MeanObjective(self._particles(horizon) if self.settings.particles else self._moments(horizon))

    def _moments(self, horizon: int) -> list[Objective]:
        settings = self.settings
        truncation = Truncation(settings.tolerance, tuple(settings.degrees), fall_back=False)
        return [
            Objective(transition, self.cost, self.start, horizon, truncation, settings.weight_penalty)
            for transition in self._transitions
        ]

    def _particles(self, horizon: int) -> list["ParticleObjective"]:
        from twbal.search.particles import ParticleObjective  # here, as PyTorch takes two seconds to import

        count = max(math.ceil(self.settings.particles / len(self.models)), 2)
        features, penalty = self.validation.features, self.settings.weight_penalty
        return [
            ParticleObjective(model, self.cost, self.start, horizon, count, features, self.seed, penalty)
            for model in self.models
        ]

    def validated(self, origin: str, policy: RbfPolicy, earlier: int | None = None) -> PolicyCandidate:
        """A policy with its cost and the result of its validation, whose robots the models share."""
        share = replace(self.validation, robots=math.ceil(self.validation.robots / len(self.models)))
        found = [validate(model, policy, self.cost, self.start, share, self.seed) for model in self.models]
        validation = ValidationResult(*(float(np.mean(values)) for values in zip(*found, strict=True)))
        robots = self.robots.ranked(origin, policy) if self.robots is not None else None
        sampled = share.robots * len(self.models) if self.robots is None else self.robots.settings.robots
        reliability = AS_IT_IS if self.robots is None else self.robots.reliability
        return PolicyCandidate(
            origin, policy, self.whole.value(policy), validation, earlier, robots, sampled, reliability
        )

    def prediction(self, candidate: PolicyCandidate) -> PredictedRollout:
        """The prediction of rollouts under a policy that is to be taken where no rollouts tell: that of the robots.

        Where there are none, the models predict.
        """
        by_robots = next(self._by_robots(candidate.policy), None)
        return by_robots or self._by_models(candidate.cost, self.predicted(candidate.policy))

    def judged(
        self, origin: str, policy: RbfPolicy, earlier: int | None, workers: int = 1
    ) -> tuple[PolicyCandidate, tuple[PredictedRollout, ...]]:
        """A policy as `validated`, and all predictions of rollouts under it, `prediction` first.

        `workers` threads do not change what is found.
        """
        with ThreadPoolExecutor(workers) as pool:
            states = pool.submit(self.predicted, policy)  # takes longest
            validated = pool.submit(self.validated, origin, policy, earlier)
            robots = pool.submit(lambda: list(self._by_robots(policy)))
        candidate, by_robots = validated.result(), robots.result()
        by_models = self._by_models(candidate.cost, states.result())
        return candidate, (*by_robots[:1], by_models, *by_robots[1:])

    def _by_models(self, cost: float, states: tuple[Gaussian, ...]) -> PredictedRollout:
        return PredictedRollout(Predictor.MODEL, min(cost, float(self.settings.horizon)), states)

    def _by_robots(self, policy: RbfPolicy) -> Iterator[PredictedRollout]:
        if self.robots is None:
            return iter(())
        return predicted_by_robots(self.robots, policy, self.settings.horizon)

    def predicted(self, policy: RbfPolicy) -> tuple[Gaussian, ...]:
        """Distributions of what the sensors show under a policy, t = 0..H; exact where the search's series are not.

        Of several models: the mean and covariance of their mixture.
        """
        horizon = self.settings.horizon
        if self.settings.particles:
            courses = [part.distributions(policy) for part in self._particles(horizon)]
        else:
            truncation = Truncation(self.settings.tolerance, tuple(self.settings.degrees))
            courses = [
                [step.next_state for step in propagate(transition, policy, self.start, horizon, truncation)]
                for transition in self._transitions
            ]
        sensors = [np.diag(model.sensor_variance) for model in self.models]  # (D, D)
        seen = [
            [Gaussian(state.mean, state.covariance + noise) for state in (self.start, *course)]
            for course, noise in zip(courses, sensors, strict=True)
        ]
        return tuple(moment_matched_mixture(states) for states in zip(*seen, strict=True))
