"""The common problem: a toy robot of three states under one control, with known hyper-parameters.

Inputs are uniform in ±[0.5, 3, 3, 1] (tilt, tilt rate w, speed v, command u); targets are one explicit step of 0.05 s,
dt·(w + dw/2), dw = dt·(15 sin θ - 4u - 0.2w) and dt·(6u - 1.5v), with noise. The policy has 50 basis functions and H is
100.
"""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from twbal.core.cost import SaturatingCost
from twbal.core.gaussian import Array, Gaussian
from twbal.models.gp import GaussianProcess, condition, squared_exponential
from twbal.models.moments.kernel_sum import KernelSum, no_kernels
from twbal.models.moments.truncation import Truncation
from twbal.policies.rbf import RbfPolicy
from twbal.search.linear_starts import regulator
from twbal.search.transition import TransitionModel

HORIZON, BASIS, PERIOD = 100, 50, 0.05
SPANS = np.array([0.5, 3.0, 3.0, 1.0])
NOISE = np.array([0.003, 0.02, 0.02])
LENGTH_SCALES = np.array([[1.0, 4.0, 8.0, 4.0], [0.9, 6.0, 8.0, 2.5], [3.0, 8.0, 5.0, 2.5]])
SIGNAL_VARIANCES = np.array([0.05, 0.6, 0.6])
START = Gaussian(np.zeros(3), 0.01 * np.eye(3))
COST = SaturatingCost(np.zeros(3), np.array([0.5, 5.0, 5.0]))


class Data(NamedTuple):
    """Samples of the toy robot: inputs (n, 4) and targets (n, 3)."""

    inputs: Array
    targets: Array


def data(n: int, seed: int, strength: float = 1.0) -> Data:
    """Samples; `strength` scales the changes, for a second GP beside the first."""
    rng = np.random.default_rng(seed)
    inputs = rng.uniform(-1.0, 1.0, (n, 4)) * SPANS
    tilt, rate, speed, command = inputs.T
    change = PERIOD * (15.0 * np.sin(tilt) - 4.0 * command - 0.2 * rate)
    targets = np.column_stack([PERIOD * (rate + change / 2.0), change, PERIOD * (6.0 * command - 1.5 * speed)])
    return Data(inputs, strength * targets + NOISE * rng.standard_normal((n, 3)))


def gp(n: int, seed: int = 0, strength: float = 1.0) -> GaussianProcess:
    """The GP of n samples at the common hyper-parameters."""
    samples = data(n, seed, strength)
    return condition(samples.inputs, samples.targets, LENGTH_SCALES, SIGNAL_VARIANCES, NOISE**2)


def kernels(n: int, keep_variance: bool, seed: int = 0, strength: float = 1.0) -> KernelSum:
    """The GP of n samples, as the search takes it.

    Without its variance only the weights are needed. They come from a process of their own, so that the memory of
    their Cholesky factors does not count as the engine's.
    """
    if keep_variance:
        whole = gp(n, seed, strength)
        return KernelSum(whole.centres, LENGTH_SCALES, SIGNAL_VARIANCES, whole.weights, whole.variance_matrix)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        weights = pool.submit(_weights, n, seed, strength).result()
    return KernelSum(data(n, seed, strength).inputs, LENGTH_SCALES, SIGNAL_VARIANCES, weights, np.zeros((3, 0, 0)))


def _weights(n: int, seed: int, strength: float) -> Array:
    samples, weights = data(n, seed, strength), []
    for a, target in enumerate(samples.targets.T):
        covariance = SIGNAL_VARIANCES[a] * squared_exponential(samples.inputs, samples.inputs, LENGTH_SCALES[a])
        covariance[np.diag_indices(n)] += NOISE[a] ** 2
        factor = cho_factor(covariance, lower=True, overwrite_a=True, check_finite=False)
        weights.append(cho_solve(factor, target))
    return np.array(weights)


def transition(f: KernelSum, g: KernelSum | None = None) -> TransitionModel:
    """f, or f + g, as the search propagates it."""
    return TransitionModel(
        f=f,
        g=no_kernels(3, 4) if g is None else g,
        carry=np.hstack([np.eye(3), np.zeros((3, 1))]),
        selection=np.eye(3),
        predicted=np.arange(3),
        inputs=np.arange(4),
        process_noise=np.zeros(3),
        observation_noise=np.zeros(3),
    )


def random_policy(seed: int = 1, weight: float = 0.1) -> RbfPolicy:
    """Centres standard normal, weights `weight` × normal, unit lengths: it falls, so its states spread widely."""
    rng = np.random.default_rng(seed)
    centres, weights = rng.standard_normal((BASIS, 3)), weight * rng.standard_normal(BASIS)
    return RbfPolicy(("tilt", "tilt_rate", "speed"), centres, weights, np.ones(3), np.zeros(3), 1.0)


def found_policy(f: GaussianProcess) -> RbfPolicy:
    """A policy that balances: a linear regulator of the model beside the random network, after 30 steps of L-BFGS."""
    from twbal.search.descent import Objective, descend  # 20 MB of scipy.optimize that the engine does without

    slope = f.slope(np.zeros((1, 4)))[0]  # (3, 4)
    A, B = np.eye(3) + slope[:, :3], slope[:, 3]
    gain = regulator(A, B, COST, 1.0)
    if gain is None:
        raise ValueError("The common problem has no regulator; was the model changed?")
    random = random_policy()
    start = RbfPolicy(random.channels, random.centres, 0.1 * random.weights, random.lengths, -gain / 1.5, 1.0)
    bare = KernelSum(f.centres, f.length_scales, f.signal_variance, f.weights, np.zeros((3, 0, 0)))
    objective = Objective(transition(bare), COST, START, HORIZON, Truncation(1e-5, (2, 4), False), 1e-4)
    return descend(objective, start, np.ones(3), True, 30)


def found_apart(n: int) -> RbfPolicy:
    """`found_policy` of n samples from a process of its own: the search's memory does not count as the engine's."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(_found, n).result()


def _found(n: int) -> RbfPolicy:
    return found_policy(gp(n))
