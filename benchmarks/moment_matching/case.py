"""Time one case in a process of its own: `python -m benchmarks.moment_matching.case '<settings as JSON>'`.

Prints one line of JSON: median CPU seconds of one cost and gradient, peak memory, and what the engine did.
"""

import json
import sys
from typing import Any

import numpy as np

from benchmarks.measure import memory_mb, timed
from benchmarks.moment_matching.problem import (
    COST,
    HORIZON,
    START,
    found_apart,
    kernels,
    random_policy,
    transition,
)
from twbal.models.moments.truncation import DEGREES, Truncation
from twbal.search.long_term_cost import long_term_cost

TOLERANCE = 1e-6
SERIES, PAIRS = Truncation(TOLERANCE, DEGREES, True), Truncation(TOLERANCE, (), True)


def run(n: int, policy: str, keep_variance: bool, difference: int, repeats: int, exact: bool) -> dict[str, Any]:
    """One case.

    Args:
        n: samples of f.
        policy: "found", or "random".
        keep_variance: of f.
        difference: samples of a g beside f, whose variance is kept; 0 has none.
        repeats: timed runs.
        exact: compare with the exact sums over pairs too.
    """
    law = found_apart(300) if policy == "found" else random_policy()
    before = memory_mb()  # of the libraries
    g = kernels(difference, True, seed=5, strength=0.1) if difference else None
    model = transition(kernels(n, keep_variance), g)
    seconds, found = timed(lambda: long_term_cost(model, law, COST, START, HORIZON, SERIES), repeats)
    result = {
        "n": n,
        "policy": policy,
        "keep_variance": keep_variance,
        "difference": difference,
        "cpu_s": seconds,
        "memory_mb": memory_mb(),
        "libraries_mb": before,
        "steps_by_pairs": found.exact_steps,
        "cost": found.value,
    }
    if exact:
        result["pairs_cpu_s"], pairs = timed(lambda: long_term_cost(model, law, COST, START, HORIZON, PAIRS), 1)
        scale = max(float(np.abs(part).max()) for part in pairs.gradient)
        errors = [float(np.abs(a - b).max()) for a, b in zip(found.gradient, pairs.gradient, strict=True)]
        result["cost_error"] = abs(found.value - pairs.value) / pairs.value
        result["gradient_error"] = max(errors) / scale
    return result


if __name__ == "__main__":
    print(json.dumps(run(**json.loads(sys.argv[1]))))
