"""Long rollouts of f + g: what a policy is worth before it goes to the robot.

The search sees H steps of a normal distribution; slow drift and rare falls lie beyond both. Here many sampled robots
are driven for as long as a real trial lasts. Each robot has a g of its own, drawn from the posterior and kept
throughout the rollout: a model error does not average out from step to step, as it does in moment matching.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from twbal.core.cost import Cost
from twbal.core.evaluation import SuccessCriterion
from twbal.core.gaussian import Gaussian
from twbal.core.streams import Stream, generator
from twbal.models.dynamics import DynamicsModel
from twbal.models.function_samples import FunctionSamples
from twbal.models.gp import GaussianProcess
from twbal.policies.rbf import RbfPolicy
from twbal.search.sampled_rollouts import Draws, limits_of, sampled_rollouts


@dataclass(frozen=True)
class Validation:
    """Drives sampled robots.

    Attributes:
        robots: how many.
        features: random features of each sampled g.
        success: when a rollout counts as a success.
    """

    robots: int
    features: int
    success: SuccessCriterion


class ValidationResult(NamedTuple):
    """What the long rollouts showed.

    Attributes:
        success: share of the sampled robots that balanced.
        cost: mean cost of a step, fallen robots costing 1.
    """

    success: float
    cost: float


def validate(
    model: DynamicsModel, policy: RbfPolicy, cost: Cost, start: Gaussian, settings: Validation, seed: int
) -> ValidationResult:
    """Drive sampled robots from `start` by `policy`.

    Raises:
        ConfigError: the state has no tilt.
    """
    rng = generator(Stream.VALIDATION, seed)
    n, rule, sensor_sd = settings.robots, settings.success, np.sqrt(model.sensor_variance)
    limits = limits_of(rule, model.names)
    samples = FunctionSamples.draw(model.g, n, settings.features, rng) if isinstance(model.g, GaussianProcess) else None
    draws = Draws(
        start=start.sample(n, rng),
        sensors=sensor_sd * rng.standard_normal((rule.steps, n, len(sensor_sd))),
        process=np.sqrt(model.process_noise) * rng.standard_normal((rule.steps, n, len(model.measured))),
    )
    if isinstance(model.f, GaussianProcess) and (model.g is None or samples):
        stayed, costs = sampled_rollouts(model, samples, policy, cost, limits, draws)
    else:  # other kernels have no compiled form
        from twbal.search.torch_functions import sampled_functions
        from twbal.search.torch_robots import Robots  # here, as PyTorch takes two seconds to import

        g = sampled_functions(model.g, n, settings.features, rng) if model.g else None
        stayed, costs = Robots.of(model, g, draws).balanced(policy.command, cost, limits)
    return ValidationResult(float(stayed.mean()), float(costs.mean()))
