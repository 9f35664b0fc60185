"""Exact GPs by evidence maximisation."""

from typing import NamedTuple

import gpytorch
import numpy as np
import torch

from twbal.core.errors import FitError
from twbal.core.gaussian import Array
from twbal.models.evidence import Evidence
from twbal.models.gp import GaussianProcess, condition
from twbal.models.hyperparameters import (
    FitSettings,
    Hyperparameters,
    LogNormalPrior,
    Reference,
    fit_hyperparameters,
)

__all__ = ["Fit", "FitSettings", "LogNormalPrior", "Reference", "exact_model", "fit_gp", "log_evidence"]

DISAGREEMENT = 1e-3  # [nats]; a rounding error of this size no longer ranks one fit before another rightly


class Fit(NamedTuple):
    """What a fit found.

    Attributes:
        gp: the posterior.
        log_evidence: (E,) log p(y | X) of each output [nats], without penalties and priors; of a sparse GP its bound.
    """

    gp: GaussianProcess
    log_evidence: Array


def fit_gp(inputs: Array, targets: Array, settings: FitSettings, seed: int, reference: Reference | None = None) -> Fit:
    """Exact GPs whose hyper-parameters maximise the evidence, less penalties and, where given, with priors.

    The search runs on the closed form of the evidence; GPyTorch has the last word on what was found.

    Args:
        inputs: (n, d), in any units.
        targets: (n, E).
        settings: how to search.
        seed: of the perturbed starts and of the samples that they compete on.
        reference: what the priors are relative to; None means std(X) and std(y)/10.

    Raises:
        FitError: too few samples, shapes that do not fit, a value that is not finite, a covariance that is too badly
            conditioned.
    """
    found = fit_hyperparameters(inputs, targets, settings, seed, reference)
    gp = condition(inputs, targets, *found)
    return Fit(gp, log_evidence(inputs, targets, found))


def log_evidence(inputs: Array, targets: Array, hyperparameters: Hyperparameters) -> Array:
    """Evidence log p(y | X) of each output [nats], (E,), by GPyTorch.

    Raises:
        FitError: the closed form disagrees, as it does where rounding errors rule.
    """
    values = []
    for a, target in enumerate(targets.T):
        model = exact_model(inputs, target, hyperparameters, a)
        evidence = gpytorch.mlls.ExactMarginalLogLikelihood(model.likelihood, model)
        with torch.no_grad(), gpytorch.settings.fast_computations(False, False, False):
            value = float(evidence(model(*model.train_inputs), model.train_targets)) * len(target)
        closed_form, _ = Evidence(inputs, target)(hyperparameters.theta(a))
        if not abs(closed_form - value) < DISAGREEMENT + 1e-6 * abs(value):
            raise FitError(
                f"The log evidence of output {a} is {closed_form:.6g} in closed form, {value:.6g} by GPyTorch: "
                "its covariance is too badly conditioned. Lower max_signal_to_noise."
            )
        values.append(value)
    return np.array(values)


class _ExactModel(gpytorch.models.ExactGP):  # type: ignore[misc]
    """Eq. 1 in GPyTorch: zero mean, SE kernel with one length-scale an input, Gaussian noise."""

    def __init__(
        self, inputs: torch.Tensor, target: torch.Tensor, likelihood: gpytorch.likelihoods.GaussianLikelihood
    ) -> None:
        super().__init__(inputs, target, likelihood)
        self.mean_module = gpytorch.means.ZeroMean()
        kernel = gpytorch.kernels.RBFKernel(ard_num_dims=inputs.shape[1], lengthscale_constraint=_positive())
        self.covar_module = gpytorch.kernels.ScaleKernel(kernel, outputscale_constraint=_positive())

    def forward(self, inputs: torch.Tensor) -> gpytorch.distributions.MultivariateNormal:
        return gpytorch.distributions.MultivariateNormal(self.mean_module(inputs), self.covar_module(inputs))


def _positive() -> gpytorch.constraints.Positive:
    # GPyTorch's own softplus constraints stop at a noise of 1e-4, which is far too much for radians.
    return gpytorch.constraints.Positive(transform=torch.exp, inv_transform=torch.log)


def exact_model(inputs: Array, target: Array, hyperparameters: Hyperparameters, output: int) -> gpytorch.models.ExactGP:
    """GPyTorch's exact GP, in training mode, of one output: inputs (n, d), target (n,)."""
    likelihood = gpytorch.likelihoods.GaussianLikelihood(noise_constraint=_positive())
    x, y = torch.tensor(inputs, dtype=torch.float64), torch.tensor(target, dtype=torch.float64)
    model = _ExactModel(x, y, likelihood).double()
    model.covar_module.base_kernel.lengthscale = torch.tensor(hyperparameters.length_scales[output])
    model.covar_module.outputscale = torch.tensor(hyperparameters.signal_variance[output])
    likelihood.noise = torch.tensor(hyperparameters.noise_variance[output])
    return model.train()
