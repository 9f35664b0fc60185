"""A cost, a start and a policy of the robot of `make_system`, and particles that drive it."""

from dataclasses import replace

import numpy as np
import pytest

from twbal.core.cost import SaturatingCost
from twbal.core.gaussian import Gaussian
from twbal.search.particles import ParticleObjective
from twbal.search.starts import PolicyParametrisation, linear_policy

SHAPE = PolicyParametrisation(
    5, True, {"tilt": 0.15, "tilt_rate": 0.8, "speed": 0.5}, command_scale=0.4, weight_sd=0.05
)
START = Gaussian(np.array([-0.1, 0.0, 0.0, 0.0]), np.diag([0.02, 0.05, 0.02, 0.0]) ** 2)
COST = SaturatingCost(np.zeros(4), np.array([0.25, 2.5, 1.0, np.inf]))


def balancing(model):
    gain = np.array([-30.0, -4.0, -2.0, 0.1])
    return linear_policy(SHAPE, model.channels.names, 20.0, gain, np.random.default_rng(0))


def particles(model, count, horizon):
    return ParticleObjective(model, COST, START, horizon, count, 100, 0, 1e-4)


def check_gradient(objective, policy, rel, abs):
    """That of each part of the policy, along a line that is drawn, against finite differences."""
    gradient = objective.cost_of(policy, gradient=True).gradient
    rng = np.random.default_rng(1)
    for name in ("centres", "weights", "lengths", "gain"):
        along = rng.standard_normal(getattr(policy, name).shape)
        along *= 1e-5 / np.abs(along).max()
        ends = [objective.value(replace(policy, **{name: getattr(policy, name) + s * along})) for s in (1, -1)]
        found = float((getattr(gradient, name) * along).sum())
        assert (ends[0] - ends[1]) / 2 == pytest.approx(found, rel=rel, abs=abs)
