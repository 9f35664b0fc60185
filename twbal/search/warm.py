"""Compile what the search runs, once: `python -m twbal.search.warm`, as a part of setting up."""

from pathlib import Path

import numpy as np

from twbal.cost import SaturatingCost
from twbal.gaussian import Gaussian
from twbal.models.moments.kernel_sum import KernelSum, no_kernels
from twbal.models.moments.prediction import Truncation
from twbal.models.smoothing import compile_filter
from twbal.policies.rbf import RbfPolicy
from twbal.search.long_term_cost import long_term_cost, machine_code_folder
from twbal.search.transition import TransitionModel


def is_compiled() -> bool:
    """Whether the machine code of the search is there already."""
    return any(Path(machine_code_folder()).glob("*.nbc"))


def compile_search() -> None:
    """Run the smallest search step there is; the machine code stays in the cache folder."""
    f = KernelSum(np.zeros((1, 2)), np.ones((1, 2)), np.ones(1), np.zeros((1, 1)), np.zeros((1, 1, 1)))
    model = TransitionModel(f, no_kernels(1, 2), np.eye(1, 2), np.array([0]), np.zeros(1), np.zeros(1))
    policy = RbfPolicy(("tilt",), np.zeros((1, 1)), np.zeros(1), np.ones(1), np.zeros(1), 1.0)
    cost = SaturatingCost(np.zeros(1), np.ones(1))
    long_term_cost(model, policy, cost, Gaussian(np.zeros(1), np.eye(1)), 1, Truncation())


if __name__ == "__main__":
    if not is_compiled():
        print("compiling the policy search, once for this version (about a minute) ...", flush=True)
        compile_search()
    compile_filter()
