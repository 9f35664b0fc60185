"""Compile what the search runs, once, as a part of setting up (`twbal.cli.warm`)."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from twbal.core.channels import Channels
from twbal.core.cost import SaturatingCost
from twbal.core.evaluation import SuccessCriterion
from twbal.core.gaussian import Gaussian
from twbal.models.dynamics import without_simulation
from twbal.models.moments.kernel_sum import KernelSum, no_kernels
from twbal.models.moments.truncation import Truncation
from twbal.policies.rbf import RbfPolicy
from twbal.search.long_term_cost import long_term_cost, machine_code_folder
from twbal.search.sampled_rollouts import machine_code_folder as rollouts_folder
from twbal.search.transition import TransitionModel
from twbal.search.validation import Validation, validate


def is_compiled() -> bool:
    """Whether the machine code of the search is there already."""
    kernels = (
        (machine_code_folder(), "long_term_cost._long_term_cost"),
        (rollouts_folder(), "sampled_rollouts._drive"),
    )
    return all(any(Path(folder).glob(f"{name}-*.nbc")) for folder, name in kernels)  # others share these folders


def compile_search() -> None:
    """Run the smallest search step there is; the machine code stays in the cache folder."""
    f = KernelSum(np.zeros((1, 2)), np.ones((1, 2)), np.ones(1), np.zeros((1, 1)), np.zeros((1, 1, 1)))
    model = TransitionModel(
        f, no_kernels(1, 2), np.eye(1, 2), np.eye(1), np.array([0]), np.arange(2), np.zeros(1), np.zeros(1)
    )
    policy = RbfPolicy(("tilt",), np.zeros((1, 1)), np.zeros(1), np.ones(1), np.zeros(1), 1.0)
    cost = SaturatingCost(np.zeros(1), np.ones(1))
    start = Gaussian(np.zeros(1), np.eye(1))
    long_term_cost(model, policy, cost, start, 1, Truncation())
    nothing = without_simulation(Channels(("tilt",), 1.0))
    rule = SuccessCriterion(tilt_limit=1.0, settled_tilt_limit=1.0, settle_step=1, steps=1)
    validate(replace(nothing, g=nothing.f), policy, cost, start, Validation(robots=1, features=1, success=rule), seed=0)
