"""Fit one data set both ways in a process of its own: `python -m benchmarks.fitting.case '<settings as JSON>'`.

The data are those of the common problem (`benchmarks.moment_matching.problem`). Our fit is the one of `model=exact`.
BoTorch fits plain GPyTorch models, one an output, of standardised data: zero mean, SE kernel with one length-scale an
input, Gaussian noise, no priors, so that what it maximises is the evidence alone. Ours does so where the limits on
length-scales and signal-to-noise are out of the way (FREE): that is compared. What the limits cost is measured beside.
"""

import json
import sys
import time
import warnings
from collections.abc import Sequence
from statistics import median
from typing import Any

import gpytorch
import numpy as np
import torch
from botorch.fit import fit_gpytorch_mll
from botorch.models import SingleTaskGP
from hydra import compose
from hydra.utils import instantiate

from benchmarks.measure import memory_mb
from benchmarks.moment_matching.problem import Data, data
from twbal.cli.composition import composing
from twbal.core.gaussian import Array

SETTINGS = "model.fit_f.settings"
FREE = [f"{SETTINGS}.max_relative_length_scale=1e6", f"{SETTINGS}.max_signal_to_noise=1e5"]


def ours(samples: Data, overrides: Sequence[str] = ()) -> tuple[float, Array]:
    """CPU seconds of our fit, and its log evidence of each output [nats]."""
    with composing():
        fit = instantiate(compose("fit_sim_gp", ["model=exact", *overrides]).model.fit_f)
    began = time.process_time()
    found = fit(samples.inputs, samples.targets, seed=0)
    return time.process_time() - began, found.log_evidence


def theirs(inputs: Array, target: Array, rng: np.random.Generator) -> tuple[float, float]:
    """CPU seconds of one fit of one output from a random start, and its log evidence; -inf where it failed."""
    scale = float(target.std())
    x = torch.tensor(inputs / inputs.std(axis=0))
    y = torch.tensor(target / scale)[:, None]
    kernel = gpytorch.kernels.ScaleKernel(gpytorch.kernels.RBFKernel(ard_num_dims=x.shape[1]))
    noise = gpytorch.likelihoods.GaussianLikelihood(noise_constraint=gpytorch.constraints.GreaterThan(1e-8))
    model = SingleTaskGP(
        x, y, likelihood=noise, covar_module=kernel, mean_module=gpytorch.means.ZeroMean(), outcome_transform=None
    )
    kernel.base_kernel.lengthscale = torch.tensor(np.exp(rng.standard_normal(x.shape[1])))
    kernel.outputscale = float(np.exp(rng.standard_normal()))
    noise.noise = float(np.exp(2.0 * rng.uniform(-4.0, 0.0)))
    evidence = gpytorch.mlls.ExactMarginalLogLikelihood(noise, model)
    began = time.process_time()
    try:
        fit_gpytorch_mll(evidence)
    except Exception as error:
        print(f"BoTorch: {error}", file=sys.stderr)
        return time.process_time() - began, -np.inf
    seconds = time.process_time() - began
    model.train()
    with torch.no_grad():
        value = float(evidence(model(*model.train_inputs), model.train_targets)) * len(target)
    return seconds, value - len(target) * np.log(scale)


def run(n: int, seed: int, starts: int) -> dict[str, Any]:
    """Our fit of data set `seed`, and BoTorch's from each of its random starts."""
    torch.set_default_dtype(torch.float64)
    torch.set_num_threads(1)
    warnings.simplefilter("ignore")
    samples = data(n, 1000 + seed)
    ours(data(30, 0))  # loads and compiles
    seconds, limited = ours(samples)
    free_seconds, evidence = ours(samples, FREE)
    memory = memory_mb()
    rng = np.random.default_rng(seed)
    fits = [[theirs(samples.inputs, target, rng) for target in samples.targets.T] for _ in range(starts)]
    best = np.max([[value for _, value in fit] for fit in fits], axis=0)
    return {
        "cpu_s": seconds,
        "free_cpu_s": free_seconds,
        "memory_mb": memory,
        "log_evidence": list(evidence),
        "limits_cost": float((evidence - limited).max()),
        "botorch_cpu_s": median(sum(spent for spent, _ in fit) for fit in fits),
        "botorch_best": list(best),
        "short_by": float((best - evidence).max()),
    }


if __name__ == "__main__":
    print(json.dumps(run(**json.loads(sys.argv[1]))))
