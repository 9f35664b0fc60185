"""Eq. 1 in GPyTorch, as independent truth for the closed forms."""

import gpytorch
import torch


class ExactModel(gpytorch.models.ExactGP):
    """Zero mean, SE kernel with one length-scale an input, Gaussian noise."""

    def __init__(self, inputs, target, likelihood):
        super().__init__(inputs, target, likelihood)
        self.mean_module = gpytorch.means.ZeroMean()
        kernel = gpytorch.kernels.RBFKernel(ard_num_dims=inputs.shape[1], lengthscale_constraint=positive())
        self.covar_module = gpytorch.kernels.ScaleKernel(kernel, outputscale_constraint=positive())

    def forward(self, inputs):
        return gpytorch.distributions.MultivariateNormal(self.mean_module(inputs), self.covar_module(inputs))


def positive():
    """By exponentials: GPyTorch's own softplus stops at a noise of 1e-4, which is far too much for radians."""
    return gpytorch.constraints.Positive(transform=torch.exp, inv_transform=torch.log)


def exact_model(inputs, target, hyperparameters, output):
    """GPyTorch's exact GP, in training mode, of one output: inputs (n, d), target (n,)."""
    likelihood = gpytorch.likelihoods.GaussianLikelihood(noise_constraint=positive())
    x, y = torch.tensor(inputs, dtype=torch.float64), torch.tensor(target, dtype=torch.float64)
    model = ExactModel(x, y, likelihood).double()
    model.covar_module.base_kernel.lengthscale = torch.tensor(hyperparameters.length_scales[output])
    model.covar_module.outputscale = torch.tensor(hyperparameters.signal_variance[output])
    likelihood.noise = torch.tensor(hyperparameters.noise_variance[output])
    return model.train()


def log_evidence(model):
    """log p(y | X) of a model in training mode [nats], a tensor, by Cholesky factors."""
    evidence = gpytorch.mlls.ExactMarginalLogLikelihood(model.likelihood, model)
    with gpytorch.settings.fast_computations(False, False, False):
        return evidence(model(*model.train_inputs), model.train_targets) * len(model.train_targets)
