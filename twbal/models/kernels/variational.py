"""GPs of 10⁵ samples: GPyTorch's stochastic variational GP (Hensman, Fusi and Lawrence 2013)."""

from dataclasses import dataclass, replace

import gpytorch
import torch
from gpytorch.variational import NaturalVariationalDistribution, VariationalStrategy

from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array
from twbal.core.streams import Stream, generator
from twbal.models.fit import GpFitResult, fit_gp
from twbal.models.fit_settings import FitSettings, PriorReference, check_samples
from twbal.models.gp import SQUARED_EXPONENTIAL, GaussianProcess
from twbal.models.hyperparameters import Hyperparameters
from twbal.models.kernels.expression import positive
from twbal.models.kernels.induced import choose_inducing, condition_induced, fit_on_subset
from twbal.models.kernels.kernel_process import KernelProcess
from twbal.models.kernels.torch_threads import one_thread
from twbal.models.sparse import random_subset

_NATURAL_RATE = 0.1  # of the variational distribution's natural gradient; a minibatch is a noisy witness
_LEAD = 30  # minibatches for the variational distribution alone: before it fits, the noise would take the blame
_CANDIDATES = 5000  # samples among which the first inducing inputs are chosen


@dataclass(frozen=True)
class VariationalSettings:
    """How a variational GP is learned.

    Attributes:
        inducing: number of inducing inputs; with no more samples than this the fit is exact.
        subset: number of samples from which the hyper-parameters are first fitted.
        steps: of gradient descent, each on a minibatch.
        batch: samples of a minibatch.
        rate: of Adam, for the inducing inputs and the logarithms of the hyper-parameters.
        fit: of the subset.
    """

    inducing: int
    subset: int
    steps: int
    batch: int
    rate: float
    fit: FitSettings

    def __post_init__(self) -> None:
        if min(self.inducing, self.subset, self.batch) < 1 or self.steps < 0:
            raise ConfigError(f"inducing, subset and batch must be at least 1, steps at least 0; found {self}.")


class VariationalModel(gpytorch.models.ApproximateGP):  # type: ignore[misc]
    """E outputs with kernels of their own over shared inducing inputs, on inputs and targets in units of their scales.

    Attributes:
        kernel: of E outputs.
        likelihood: noise of E outputs.
    """

    def __init__(self, inducing: Array, prior: KernelProcess) -> None:
        """Begin at inducing inputs (m, d) and the hyper-parameters of `prior`."""
        batch = torch.Size([prior.outputs])
        # Without noise in the beginning: GPyTorch draws it from the global stream of random numbers.
        guess = NaturalVariationalDistribution(len(inducing), batch_shape=batch, mean_init_std=0.0)
        super().__init__(VariationalStrategy(self, torch.tensor(inducing), guess, learn_inducing_locations=True))
        self.kernel = replace(prior).module.requires_grad_(True)  # of a copy's, as it is going to change
        self.likelihood = gpytorch.likelihoods.GaussianLikelihood(noise_constraint=positive(), batch_shape=batch)
        self.double()
        self.likelihood.noise = torch.tensor(prior.noise_variance / prior.target_scales**2)[:, None]

    def forward(self, inputs: torch.Tensor) -> gpytorch.distributions.MultivariateNormal:
        """The prior at inputs (..., n, d)."""
        mean = inputs.new_zeros(*self.kernel.batch_shape, inputs.shape[-2])
        return gpytorch.distributions.MultivariateNormal(mean, self.kernel(inputs))


def fit_variational_gp(
    inputs: Array,
    targets: Array,
    settings: VariationalSettings,
    seed: int,
    reference: PriorReference | None = None,
    kernel: str = SQUARED_EXPONENTIAL,
    near: Hyperparameters | None = None,
) -> GpFitResult:
    """GPs over inducing inputs that minibatches of all samples choose; the log evidence is Titsias' bound.

    The hyper-parameters begin at those of a random subset. Minibatches then move them and the inducing inputs up the
    evidence lower bound, with natural gradients for the values there. Given both, the best variational distribution of
    all samples is known in closed form (Titsias 2009), and is taken.

    Args:
        inputs: (n, d), in any units.
        targets: (n, E).
        settings: how to learn.
        seed: of the subset, its starts and the minibatches.
        reference: what the subset's priors are relative to; None means std(X) and std(y)/10.
        kernel: as of `fit_gp`; with the squared exponential one the posterior can be moment matched.
        near: of use only where the fit is exact, as samples are few.

    Raises:
        ConfigError: `kernel` is none.
        FitError: too few samples, shapes that do not fit, a value that is not finite.
    """
    check_samples(inputs, targets)
    if len(inputs) <= settings.inducing:
        return fit_gp(inputs, targets, settings.fit, seed, reference, kernel, near)
    with one_thread():
        prior = fit_on_subset(inputs, targets, kernel, settings.subset, settings.fit, seed, reference)
        candidates = inputs[random_subset(len(inputs), _CANDIDATES, seed)]
        centres = choose_inducing(candidates, prior, settings.inducing, tolerance=0.0)
        prior, centres = learn(inputs, targets, centres, prior, settings, seed)
        process, bound = condition_induced(inputs, targets, centres, prior)
    return GpFitResult(squared_exponential_process(process) if kernel == SQUARED_EXPONENTIAL else process, bound)


def learn(
    inputs: Array, targets: Array, centres: Array, prior: KernelProcess, settings: VariationalSettings, seed: int
) -> tuple[KernelProcess, Array]:
    """The prior and inducing inputs (m, d) to which minibatches move the given ones."""
    x, y = torch.tensor(inputs / prior.input_scales), torch.tensor(targets / prior.target_scales)
    model = VariationalModel(centres / prior.input_scales, prior)
    bound = gpytorch.mlls.VariationalELBO(model.likelihood, model, num_data=len(x))
    natural = gpytorch.optim.NGD(model.variational_parameters(), num_data=len(x), lr=_NATURAL_RATE)
    ordinary = torch.optim.Adam(model.hyperparameters(), lr=settings.rate)
    rng = generator(Stream.FIT_RESTARTS, seed)
    model.train()
    for step in range(settings.steps):
        chosen = torch.tensor(rng.integers(len(x), size=min(settings.batch, len(x))))
        natural.zero_grad()
        ordinary.zero_grad()
        loss = -bound(model(x[chosen]), y[chosen].T).sum()
        loss.backward()
        natural.step()
        if step >= _LEAD:
            ordinary.step()
    model.requires_grad_(False)
    raw = {name: value.numpy().copy() for name, value in model.kernel.named_parameters()}
    noise = model.likelihood.noise[:, 0].numpy() * prior.target_scales**2
    places = model.variational_strategy.inducing_points.numpy() * prior.input_scales
    return replace(prior, parameters=raw, noise_variance=noise), places


def squared_exponential_process(process: KernelProcess) -> GaussianProcess:
    """The same posterior, of the kernel `se`, as one that moment matching can use."""
    kernel = process.module
    return GaussianProcess(
        process.centres,
        kernel.base_kernel.lengthscale[:, 0, :].numpy() * process.input_scales,
        kernel.outputscale.numpy() * process.target_scales**2,
        process.noise_variance,
        process.weights,
        process.variance_matrix,
        process.sample_root,
    )
