"""Where the time of a step goes: `python -m benchmarks.moment_matching.profile '<settings as JSON>'`.

Every kernel is timed by itself on what the steps of the horizon give it (the found policy, f's variance dropped); all
figures are means over the steps. The floor of the sums over points counts multiply-adds and takes them at the rate at
which this core multiplies matrices, and exponentials at the rate of the vector kernel.
"""

import json
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from statistics import median
from typing import Any

import numpy as np

from benchmarks.moment_matching.problem import COST, HORIZON, START, found_policy, gp, kernels, transition
from twbal.core.cost import expected_cost
from twbal.core.exponential import expm1_in_place
from twbal.models.moments.taylor import add_derivatives, smoothed_weights
from twbal.models.moments.truncation import DEGREES, Truncation, series
from twbal.policies.rbf_moments import activation_adjoint, activation_moments
from twbal.search.long_term_cost import long_term_cost, propagate

TRUNCATION = Truncation(1e-6, DEGREES, True)


def microseconds(work: Callable[[], object], least_s: float = 0.05) -> float:
    """CPU time of one call, the median of seven batches [µs]."""
    work()
    began, calls = time.process_time(), 0
    while time.process_time() - began < least_s:
        work()
        calls += 1
    batches = []
    for _ in range(7):
        began = time.process_time()
        for _ in range(calls):
            work()
        batches.append((time.process_time() - began) / calls * 1e6)
    return median(batches)


def rates() -> dict[str, float]:
    """What this core can do: billions of multiply-adds a second, and nanoseconds for one e^x - 1."""
    a = np.ones((256, 256))
    numbers = np.linspace(-20.0, 0.0, 4096)
    scratch = numbers.copy()

    def exponentials() -> None:
        scratch[:] = numbers
        expm1_in_place(scratch)

    return {
        "multiply_adds_per_ns": 256**3 / microseconds(lambda: a @ a) / 1e3,
        "ns_per_exponential": microseconds(exponentials) / 4096 * 1e3,
    }


def run(n: int) -> dict[str, Any]:
    """One size."""
    law, f = found_policy(gp(300)), kernels(n, False)
    model, network = transition(f), law.network
    problem, machine = series(TRUNCATION, 4), rates()
    steps = propagate(model, law, START, HORIZON, TRUNCATION)
    first = problem.indices.first
    tables = [np.zeros((3, first[step.prediction.degree + 3])) for step in steps]
    places = [
        (T, f, *step.joint, step.prediction.basis, problem.indices) for T, step in zip(tables, steps, strict=True)
    ]
    seen = [(network, *step.state) for step in steps]
    one_gp = (f.inputs, f.length_scales[0], f.signal_variance[0], f.weights[0])
    multiply_adds = float(np.mean([3 * n * (T.shape[1] + 2 * 4 * 4) for T in tables]))
    exponentials_us = 3 * n * machine["ns_per_exponential"] / 1e3

    def mean_us(work: Callable[..., object], arguments: Sequence[tuple[Any, ...]]) -> float:
        return microseconds(lambda: [work(*each) for each in arguments]) / HORIZON

    def whole_us(gradient: bool) -> float:
        work = partial(long_term_cost, model, law, COST, START, HORIZON, TRUNCATION, gradient)
        return microseconds(work, 0.3) / HORIZON

    return {
        "n": n,
        "degrees": sorted({step.prediction.degree for step in steps}),
        "terms": float(np.mean([T.shape[1] for T in tables])),
        "step_us": whole_us(True),
        "forward_us": whole_us(False),
        "sums_over_points_us": mean_us(add_derivatives, places),
        "weights_us": 3.0 * mean_us(smoothed_weights, [(*one_gp, *step.joint) for step in steps]),
        "policy_forward_us": mean_us(activation_moments, seen),
        "policy_back_us": mean_us(activation_adjoint, [(*each, 1.0, START.mean, 1.0) for each in seen]),
        "cost_us": mean_us(expected_cost, [(COST.target, COST.widths, *step.state) for step in steps]),
        "multiply_adds": multiply_adds,
        "exponentials": 3 * n,
        "floor_us": multiply_adds / machine["multiply_adds_per_ns"] / 1e3 + exponentials_us,
        **machine,
    }


if __name__ == "__main__":
    print(json.dumps(run(**json.loads(sys.argv[1]))))
