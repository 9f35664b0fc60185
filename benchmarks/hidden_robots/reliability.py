"""How often policies succeed that were given a probability: the correction in conf/groups/robust.yaml.

    python -m benchmarks.hidden_robots.reliability

Fits a and b of 1 / (1 + exp(-a - b logit p)) to benchmarks/results/reliability.json by maximum likelihood, one pair for
policies that were found before the robot was driven and one for later ones. Each policy counts once, whatever the
number of its trials: trials of one policy mostly end alike.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.special import log_expit, logit

FILE = Path("benchmarks/results/reliability.json")
_BOUNDS = ((-20.0, 20.0), (0.0, 20.0))  # of a, and of b: a larger probability never says less


class Driven(NamedTuple):
    """A policy that was given a probability and then driven.

    Attributes:
        family: of the robot.
        seed: of the robot.
        iteration: 0 before the robot was driven.
        probability: p, not corrected.
        successes: of its trials.
        trials: how many.
    """

    family: str
    seed: int
    iteration: int
    probability: float
    successes: int
    trials: int


def fitted(policies: Sequence[Driven]) -> tuple[float, float]:
    """a and b of the likeliest correction."""
    given = logit(np.array([policy.probability for policy in policies]))
    share = np.array([policy.successes / policy.trials for policy in policies])

    def surprise(x: np.ndarray) -> float:
        corrected = x[0] + x[1] * given
        return -float(np.sum(share * log_expit(corrected) + (1.0 - share) * log_expit(-corrected)))

    intercept, slope = minimize(surprise, [0.0, 1.0], bounds=_BOUNDS).x
    return float(intercept), float(slope)


def recorded() -> list[Driven]:
    """The policies of the file."""
    return [Driven(**each) for each in json.loads(FILE.read_text())]


def main() -> None:
    """Print both pairs."""
    policies = recorded()
    for name, found in (
        ("reliability_sheet", [policy for policy in policies if policy.iteration == 0]),
        ("reliability_rollouts", [policy for policy in policies if policy.iteration > 0]),
    ):
        intercept, slope = fitted(found)
        print(f"{name}: [{intercept:.3g}, {slope:.2g}]  # {len(found)} policies")


if __name__ == "__main__":
    main()
