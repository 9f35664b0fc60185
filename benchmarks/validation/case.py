"""Time one case in a process of its own: `python -m benchmarks.validation.case '<settings as JSON>'`.

The robot has the default's state (tilt, its rate, speed, two past commands, position and its integral) under a late
command: f learns a linear robot, g a gain that is a tenth larger. A linear-quadratic regulator holds all sampled
robots, so that every one of them is followed to the end.

Prints one line of JSON: median CPU seconds of one validation, by compiled code and by PyTorch, and what it found.
"""

import json
import sys
from typing import Any

import numpy as np

from benchmarks.measure import timed
from twbal.core.channels import Channels
from twbal.core.cost import SaturatingCost
from twbal.core.evaluation import SuccessCriterion
from twbal.core.gaussian import Array, Gaussian
from twbal.core.streams import Stream, generator
from twbal.models.dynamics import DynamicsModel
from twbal.models.function_samples import FunctionSamples
from twbal.models.gp import GaussianProcess, condition
from twbal.models.kernels.torch_threads import one_thread
from twbal.policies.rbf import RbfPolicy
from twbal.search.linear_starts import linear_law, regulator
from twbal.search.sampled_rollouts import Draws, limits_of
from twbal.search.torch_functions import SampledFunctions
from twbal.search.torch_robots import Robots
from twbal.search.validation import Validation, validate

PERIOD = 0.02
NAMES = ("tilt", "tilt_rate", "speed", "command_1", "command_2", "position", "position_integral")
SPANS = np.array([0.5, 3.0, 2.0, 1.0, 1.0, 1.0])  # of the inputs: the first five channels and the command
SHARES = np.array([0.5, 0.2, 0.3])  # of the torque: command_1, command_2, present command
COST = SaturatingCost(np.zeros(7), np.array([0.25, 2.5, 1.0, 1.0, np.inf, 0.5, 0.5]))
START = Gaussian(np.array([-0.17, 0, 0, 0, 0, 0, 0]), np.diag([0.02, 0.05, 0.02, 0, 0, 0, 0]) ** 2)
SHORT = 60  # steps over which rounding does not grow


def changes(inputs: Array) -> Array:
    """What changes in a control period, (n, 3), of tilt, its rate and the speed."""
    tilt, rate, speed, torque = *inputs[:, :3].T, inputs[:, 3:] @ SHARES
    pull = PERIOD * (15.0 * tilt - 30.0 * torque)
    return np.column_stack([PERIOD * (rate + pull / 2.0), pull, PERIOD * (12.0 * torque - 0.5 * speed)])


def gp(n: int, seed: int, strength: float) -> GaussianProcess:
    """Of n samples of `strength` times the changes, with noise."""
    rng = np.random.default_rng(seed)
    inputs = SPANS * rng.uniform(-1.0, 1.0, (n, 6))
    whole = changes(inputs)
    sd, noise = strength * whole.std(axis=0), 0.01 * whole.std(axis=0)
    targets = strength * whole + noise * rng.standard_normal((n, 3))
    return condition(inputs, targets, np.tile(5.0 * SPANS, (3, 1)), (4.0 * sd) ** 2, noise**2)


def law() -> RbfPolicy:
    """The regulator of the linear robot."""
    slope = changes(np.eye(6)).T  # (3, 6)
    A, B = np.zeros((7, 7)), np.zeros(7)
    A[:3, :5], B[:3] = np.eye(3, 5) + slope[:, :5], slope[:, 5]
    B[3] = A[4, 3] = A[5, 5] = A[6, 6] = 1.0
    A[5, 2] = A[6, 5] = PERIOD
    gain = regulator(A, B, COST, 1.0)
    if gain is None:
        raise ValueError("The problem has no regulator; was the robot changed?")
    return linear_law(NAMES, gain, 1.0, 0.0)


def run(f: int, g: int, robots: int, features: int, steps: int, repeats: int) -> dict[str, Any]:
    """One case.

    Args:
        f: its samples.
        g: its samples.
        robots: sampled.
        features: random features of each sampled g.
        steps: of a rollout.
        repeats: timed runs of compiled code.
    """
    channels = Channels(NAMES, 0.15, PERIOD)
    model = DynamicsModel(channels, gp(f, 0, 1.0), gp(g, 1, 0.1), False, np.full(3, 1e-8), np.full(3, 1e-6))
    rule = SuccessCriterion(tilt_limit=0.5236, settled_tilt_limit=0.1745, settle_step=100, steps=steps)
    settings, policy = Validation(robots, features, rule), law()
    seconds, found = timed(lambda: validate(model, policy, COST, START, settings, 0), repeats)
    plain_seconds, _ = timed(lambda: by_torch(model, policy, settings), 3)
    brief = Validation(robots, features, SuccessCriterion(0.5236, 0.1745, settle_step=SHORT, steps=SHORT))
    gap = abs(validate(model, policy, COST, START, brief, 0).cost - by_torch(model, policy, brief))
    return {"cpu_s": seconds, "torch_cpu_s": plain_seconds, "success": found.success, "cost": found.cost, "gap": gap}


def by_torch(model: DynamicsModel, policy: RbfPolicy, settings: Validation) -> float:
    """The mean cost of the same rollouts in PyTorch."""
    rng, n, rule = generator(Stream.VALIDATION, 0), settings.robots, settings.success
    samples = FunctionSamples.draw(model.g, n, settings.features, rng)
    draws = Draws(
        start=START.sample(n, rng),
        sensors=np.sqrt(model.sensor_variance) * rng.standard_normal((rule.steps, n, 7)),
        process=np.sqrt(model.process_noise) * rng.standard_normal((rule.steps, n, 3)),
    )
    with one_thread():
        robots = Robots.of(model, SampledFunctions(samples), draws)
        return float(robots.balanced(policy.command, COST, limits_of(rule, NAMES)).costs.mean())


if __name__ == "__main__":
    print(json.dumps(run(**json.loads(sys.argv[1]))))
