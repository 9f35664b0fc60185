"""The same cost and gradient by torchrl's PILCO modules: `python -m benchmarks.moment_matching.peer '<settings>'`.

torchrl keeps the model's variance, so it is compared with our engine with the variance kept. Its GP gets the common
hyper-parameters instead of a fit; its policy squashes by a sine, its cost is of the same form. The horizon may be cut
short, as its memory grows with it: CPU seconds are then of so many steps, and scaled to H.
"""

import json
import sys
import time
from statistics import median
from typing import Any

import torch
from tensordict import TensorDict
from torchrl.modules.models.gp import GPWorldModel
from torchrl.modules.models.rbf_controller import RBFController
from torchrl.objectives.pilco import ExponentialQuadraticCost

from benchmarks.measure import memory_mb
from benchmarks.moment_matching.problem import BASIS, COST, HORIZON, START, found_policy, gp, random_policy
from twbal.policies.rbf import RbfPolicy


def world(n: int) -> GPWorldModel:
    """The common GP in the peer's clothes."""
    ours = gp(n)
    model = GPWorldModel(obs_dim=3, action_dim=1)
    model.X_tilde_train = torch.tensor(ours.centres)
    model.ell = torch.tensor(ours.length_scales)
    model.alpha_sq = torch.tensor(ours.signal_variance)[:, None]
    model.sigma_sq_eps = torch.tensor(ours.noise_variance)
    model._cached_inv_K_noisy = torch.tensor(ours.variance_matrix)
    model._cached_beta = torch.tensor(ours.weights)
    return model


def controller(policy: RbfPolicy) -> RBFController:
    """The random network in the peer's clothes (which know no linear part)."""
    law = RBFController(3, 1, policy.max_command, BASIS)
    law.centers.data = torch.tensor(policy.centres)
    law.weights.data = torch.tensor(policy.weights)[:, None]
    law.lengthscales.data = torch.tensor(policy.lengths)
    return law


def cost_and_gradient(model: GPWorldModel, law: RBFController, horizon: int) -> float:
    """J over `horizon` steps; the gradient is left in the law's parameters."""
    law.zero_grad()
    price = ExponentialQuadraticCost(torch.zeros(3), torch.diag(torch.tensor(COST.widths**-2.0)), reduction="sum")
    mean, covariance = torch.tensor(START.mean)[None], torch.tensor(START.covariance)[None]
    total = torch.zeros(())
    for _ in range(horizon):
        action, variance, slope = law(mean, covariance)
        step = TensorDict(
            {
                "action": {"mean": action, "var": variance, "cross_covariance": slope},
                "observation": {"mean": mean, "var": covariance},
            },
            batch_size=[1],
        )
        after = model(step)
        mean, covariance = after["next", "observation", "mean"], after["next", "observation", "var"]
        reached = TensorDict({"observation": {"mean": mean, "var": covariance}}, batch_size=[1])
        total = total + price(reached)["loss_cost"]
    total.backward()
    return float(total)


def run(n: int, policy: str, horizon: int, repeats: int) -> dict[str, Any]:
    """One case, in as many repeats after one that warms up (none where `repeats` is 1: it takes long)."""
    torch.set_default_dtype(torch.float64)
    torch.set_num_threads(1)
    law = controller(found_policy(gp(300)) if policy == "found" else random_policy())
    model, seconds, cost = world(n), [], 0.0
    for _ in range(repeats + (repeats > 1)):
        began = time.process_time()
        cost = cost_and_gradient(model, law, horizon)
        seconds.append(time.process_time() - began)
    cpu_s = median(seconds[repeats > 1 :]) * HORIZON / horizon
    return {"n": n, "policy": policy, "steps": horizon, "cpu_s": cpu_s, "memory_mb": memory_mb(), "cost": cost}


if __name__ == "__main__":
    print(json.dumps(run(**json.loads(sys.argv[1]))))
