"""Exact GPs with any kernel, by GPyTorch's marginal likelihood and scipy's L-BFGS-B."""

import warnings
from collections.abc import Sequence
from dataclasses import replace

import gpytorch
import numpy as np
import scipy.optimize
import torch
from gpytorch.kernels import Kernel, PeriodicKernel
from linear_operator.utils.errors import NanError, NotPSDError
from linear_operator.utils.warnings import NumericalWarning
from torch.nn.utils import parameters_to_vector, vector_to_parameters

from twbal.core.errors import FitError
from twbal.core.gaussian import Array
from twbal.core.streams import Stream, generator
from twbal.models.fit import GpFitResult
from twbal.models.fit_settings import (
    START_NOISE,
    FitSettings,
    PriorReference,
    check_samples,
    input_scales,
    reference_of,
    target_scale,
)
from twbal.models.gp import solve
from twbal.models.kernels.expression import build, positive
from twbal.models.kernels.kernel_process import KernelProcess, prior_process
from twbal.models.kernels.torch_threads import one_thread

_FARTHEST = np.log(1e4)  # of a parameter from 1, in its logarithm
_WORSE_THAN_ALL = 1e10  # stands for an evidence that cannot be computed: the line search steps back from it


class ExactModel(gpytorch.models.ExactGP):  # type: ignore[misc]
    """One output: zero mean, any kernel, Gaussian noise."""

    def __init__(self, inputs: torch.Tensor, target: torch.Tensor, kernel: Kernel) -> None:
        super().__init__(inputs, target, gpytorch.likelihoods.GaussianLikelihood(noise_constraint=positive()))
        self.mean_module, self.covar_module = gpytorch.means.ZeroMean(), kernel
        self.double()

    def forward(self, inputs: torch.Tensor) -> gpytorch.distributions.MultivariateNormal:
        """The prior at inputs (n, d)."""
        return gpytorch.distributions.MultivariateNormal(self.mean_module(inputs), self.covar_module(inputs))


def fit_exact(
    inputs: Array, targets: Array, kernel: str, settings: FitSettings, seed: int, reference: PriorReference | None
) -> GpFitResult:
    """Exact GPs with any kernel; see `models.fit.fit_gp`."""
    with one_thread():
        return condition(inputs, targets, fit_prior(inputs, targets, kernel, settings, seed, reference))


def condition(inputs: Array, targets: Array, prior: KernelProcess) -> GpFitResult:
    """Exact posterior with the kernel and noise of `prior`: inputs (n, d), targets (n, E)."""
    process = prior.over(inputs)
    solved, evidence = [], []
    for a, (covariance, target) in enumerate(zip(process.covariances(inputs), targets.T, strict=True)):
        total = covariance + process.noise_variance[a] * np.eye(len(inputs))
        solved.append(solve(total, target, a))
        determinant = np.linalg.slogdet(2.0 * np.pi * total)[1]
        evidence.append(-0.5 * (target @ solved[a][0] + determinant))
    weights, inverses = map(np.array, zip(*solved, strict=True))
    return GpFitResult(replace(process, weights=weights, variance_matrix=inverses), np.array(evidence))


def fit_prior(
    inputs: Array,
    targets: Array,
    kernel: str,
    settings: FitSettings,
    seed: int,
    reference: PriorReference | None = None,
) -> KernelProcess:
    """A prior, and the noise, that maximise the evidence within limits and, where given, with priors of their own.

    Of the settings, `own_choices` is for the closed form alone: here all starts compete on `screening_points` samples.
    The limits on length-scales and noise are bounds of the search instead of penalties.

    Raises:
        FitError: too few samples, shapes that do not fit, a value that is not finite, or no evidence at any start.
        ConfigError: `kernel` is none.
    """
    check_samples(inputs, targets)
    reference = reference or reference_of(inputs, targets)
    rng = generator(Stream.FIT_RESTARTS, seed)
    scales, sizes = input_scales(inputs), np.array([target_scale(target) for target in targets.T])
    x = torch.tensor(inputs / scales)
    found = []
    for a, target in enumerate(targets.T):
        model = ExactModel(x, torch.tensor(target / sizes[a]), build(kernel, inputs.shape[1]))
        scaled = PriorReference(reference.length_scales[a] / scales, reference.noise_sd[a] / sizes[a])
        _register_priors(model, settings, scaled)
        model.likelihood.noise = START_NOISE**2
        if target.any():
            _search(model, settings, rng, a)
        found.append(model.requires_grad_(False))
    raw = [dict(model.covar_module.named_parameters()) for model in found]
    parameters = {name: torch.stack([values[name] for values in raw]).numpy() for name in raw[0]}
    noise = np.array([model.likelihood.noise.item() for model in found]) * sizes**2
    return prior_process(kernel, parameters, scales, sizes, noise)


def _register_priors(model: ExactModel, settings: FitSettings, reference: PriorReference) -> None:
    """Log-normal priors on length-scales (but for those of waves, which are no distances) and on the noise."""
    prior = settings.length_scale_prior
    if prior:
        mean = torch.tensor(np.log(reference.length_scales) + prior.log_mean)
        normal = gpytorch.priors.NormalPrior(mean, torch.full_like(mean, prior.log_sd))
        for part in model.covar_module.modules():
            if isinstance(part, Kernel) and part.has_lengthscale and not isinstance(part, PeriodicKernel):
                part.register_prior("length_scale_prior", normal, lambda kernel: kernel.lengthscale.log())
    if settings.noise_prior:
        mean = torch.tensor(np.log(reference.noise_sd) + settings.noise_prior.log_mean)
        normal = gpytorch.priors.NormalPrior(mean, torch.full_like(mean, settings.noise_prior.log_sd))
        model.likelihood.noise_covar.register_prior("noise_prior", normal, lambda noise: 0.5 * noise.noise.log())


def _search(model: ExactModel, settings: FitSettings, rng: np.random.Generator, output: int) -> None:
    """Give a model the best parameters of several searches."""
    x, y = model.train_inputs[0], model.train_targets
    start = parameters_to_vector(model.parameters()).detach().numpy()
    away = settings.perturbation * rng.standard_normal((settings.starts, len(start)))
    starts = [start, *(start + away[1:])]
    chosen = torch.tensor(rng.permutation(len(y))[: settings.screening_points])
    if len(chosen) < len(y):
        model.set_train_data(x[chosen], y[chosen], strict=False)
        results = sorted((_minimise(model, each, settings) for each in starts), key=lambda result: result[0])
        starts = [vector for _, vector in results[: settings.finalists]]
        model.set_train_data(x, y, strict=False)
    best, vector = min((_minimise(model, each, settings) for each in starts), key=lambda result: result[0])
    if best >= _WORSE_THAN_ALL:
        raise FitError(
            f"The covariance of output {output} is not positive definite from any of {settings.starts} starts. "
            "Lower max_signal_to_noise of the fit, or choose another model.kernel."
        )
    vector_to_parameters(torch.tensor(vector), model.parameters())


def _minimise(model: ExactModel, start: Array, settings: FitSettings) -> tuple[float, Array]:
    """Minus evidence and log prior [nats], and the parameters there, after L-BFGS-B from `start`."""
    evidence = gpytorch.mlls.ExactMarginalLogLikelihood(model.likelihood, model)
    parameters = list(model.parameters())

    def value(vector: Array) -> tuple[float, Array]:
        vector_to_parameters(torch.tensor(vector), parameters)
        model.zero_grad()
        try:
            loss = -evidence(model(*model.train_inputs), model.train_targets) * len(model.train_targets)
            loss.sum().backward()
        except (NanError, NotPSDError):
            return _WORSE_THAN_ALL, np.zeros_like(vector)
        slope = parameters_to_vector([torch.zeros_like(p) if p.grad is None else p.grad for p in parameters])
        good = torch.isfinite(loss).all() and torch.isfinite(slope).all()
        return (loss.item(), slope.numpy()) if good else (_WORSE_THAN_ALL, np.zeros_like(vector))

    model.train()
    bounds = _bounds(model, settings)
    with warnings.catch_warnings(), gpytorch.settings.fast_computations(False, False, False):
        warnings.simplefilter("ignore", NumericalWarning)  # a little jitter on the way is no news
        found = scipy.optimize.minimize(
            value,
            np.clip(start, *np.transpose(bounds)),
            jac=True,
            method="L-BFGS-B",
            bounds=bounds,
            options={"maxiter": settings.iterations, "ftol": 1e-9, "gtol": 1e-3},
        )
    return float(found.fun), found.x


def _bounds(model: ExactModel, settings: FitSettings) -> Sequence[tuple[float, float]]:
    """Of each number of a model's parameters; those that are kept by their logarithms have 1 in the middle."""
    scale, ratio = np.log(settings.max_relative_length_scale), np.log(settings.max_signal_to_noise)
    bounds: list[tuple[float, float]] = []
    for name, raw in model.named_parameters():
        within = (-_FARTHEST, _FARTHEST)
        if name.endswith("raw_lengthscale"):
            within = (-scale, scale)
        elif name.startswith("likelihood."):
            within = (-2.0 * ratio, _FARTHEST)
        bounds += [within] * raw.numel()
    return bounds
