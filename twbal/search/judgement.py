"""Long rollouts of f + g: what a policy is worth before it goes to the robot.

The search sees H steps of a normal distribution; slow drift and rare falls lie beyond both. Here many sampled robots
are driven for as long as a real trial lasts. Each robot has a g of its own, drawn from the posterior and kept
throughout the rollout: a model error does not average out from step to step, as it does in moment matching.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from twbal.cost import SaturatingCost
from twbal.evaluation import SuccessRule
from twbal.gaussian import Array, Gaussian
from twbal.models.dynamics import DynamicsModel
from twbal.models.function_samples import FunctionSamples
from twbal.policies.rbf import RbfPolicy
from twbal.streams import Stream, generator

_FAR = 1e3
"""No channel of a falling robot is followed beyond this."""


@dataclass(frozen=True)
class Judge:
    """Drives sampled robots.

    Attributes:
        robots: how many.
        features: random features of each sampled g.
        rule: when a rollout counts as a success.
    """

    robots: int
    features: int
    rule: SuccessRule


class Judgement(NamedTuple):
    """What the long rollouts showed.

    Attributes:
        success: share of the sampled robots that balanced.
        cost: mean cost of a step, fallen robots costing 1.
    """

    success: float
    cost: float


def judge(
    model: DynamicsModel, policy: RbfPolicy, cost: SaturatingCost, start: Gaussian, settings: Judge, seed: int
) -> Judgement:
    """Drive sampled robots from `start` by `policy`.

    Raises:
        ConfigError: the state has no tilt.
    """
    rng = generator(Stream.VALIDATION, seed)
    n, rule = settings.robots, settings.rule
    tilt = model.channels.names.index("tilt")
    measured = list(model.channels.measured)
    sensor_sd = np.zeros(len(model.channels.names))
    sensor_sd[measured] = np.sqrt(model.observation_noise)
    samples = FunctionSamples.draw(model.g, n, settings.features, rng) if model.g else None
    states = start.sample(n, rng)
    up, fallen = np.ones(n, dtype=bool), np.zeros(n, dtype=bool)
    total = 0.0
    for step in range(1, rule.steps + 1):
        seen = states + sensor_sd * rng.standard_normal(states.shape)
        states = _advance(model, samples, states, policy.command(seen), rng)
        angle = np.abs(states[:, tilt])
        up &= angle <= (rule.settle_limit if step >= rule.settle_step else rule.limit)
        fallen |= angle > rule.limit
        total += float(np.where(fallen, 1.0, cost(states)).mean())
        states = np.clip(states, -_FAR, _FAR)
    return Judgement(float(up.mean()), total / rule.steps)


def _advance(
    model: DynamicsModel, samples: FunctionSamples | None, states: Array, commands: Array, rng: np.random.Generator
) -> Array:
    """One step of all robots, each with its own g, (n, D)."""
    inputs = np.column_stack([states, commands])
    change = model.f.mean(inputs)
    if samples is not None:
        change = change + samples(inputs)
    change = change + np.sqrt(model.process_noise) * rng.standard_normal(change.shape)
    return inputs @ model.transition_matrix.T + change @ model.selection.T
