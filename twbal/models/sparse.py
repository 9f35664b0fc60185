"""Sparse GPs for many samples: a few inducing inputs, chosen among the samples, stand for all of them."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array
from twbal.core.streams import Stream, generator
from twbal.core.threads import in_threads
from twbal.models.bound import JITTER, Bound
from twbal.models.evidence import Evidence
from twbal.models.fit import GpFitResult, fit_gp
from twbal.models.fit_objective import FitObjective
from twbal.models.fit_settings import FitSettings, PriorReference, check_samples
from twbal.models.gp import SQUARED_EXPONENTIAL, GaussianProcess, squared_exponential
from twbal.models.hyperparameters import Hyperparameters, Integers, fit_hyperparameters, objectives

_LOSS = 0.5  # of the subset's evidence, by which the bound may move hyper-parameters [nats a sample]


@dataclass(frozen=True)
class SparseSettings:
    """How a sparse GP is made.

    Attributes:
        inducing: number of inducing inputs, at most; with no more samples than this the fit is exact.
        subset: number of samples from which the hyper-parameters are first fitted.
        iterations: of L-BFGS, at most, by which the bound on all samples then moves them.
        tolerance: no more inducing inputs are added once all samples together lose less than this [nats].
        fit: of the subset; its penalties and priors hold for the bound too.
    """

    inducing: int
    subset: int
    iterations: int
    tolerance: float
    fit: FitSettings

    def __post_init__(self) -> None:
        if min(self.inducing, self.subset) < 1 or self.iterations < 0:
            raise ConfigError(f"inducing and subset must be at least 1, iterations at least 0; found {self}.")


def fit_sparse_gp(
    inputs: Array,
    targets: Array,
    settings: SparseSettings,
    seed: int,
    reference: PriorReference | None = None,
    kernel: str = SQUARED_EXPONENTIAL,
    near: Hyperparameters | None = None,
) -> GpFitResult:
    """GPs by Titsias' bound (2009) over inducing inputs that all outputs share; its log evidence is the bound.

    The hyper-parameters come from a random subset, then from the bound (of the SE kernel; those of another kernel stay
    the subset's); the inducing inputs are chosen for each.

    Args:
        inputs: (n, d), in any units.
        targets: (n, E).
        settings: how to fit.
        seed: of the subset and of the starts.
        reference: what the priors are relative to; None means std(X) and std(y)/10.
        kernel: see `fit_gp` for this and the next.
        near: of much the same samples.

    Raises:
        FitError: too few samples, shapes that do not fit, a value that is not finite.
    """
    check_samples(inputs, targets)
    if len(inputs) <= settings.inducing:
        return fit_gp(inputs, targets, settings.fit, seed, reference, kernel, near)
    if kernel != SQUARED_EXPONENTIAL:
        from twbal.models.kernels.induced import fit_induced  # here, as GPyTorch takes a while to import

        return fit_induced(inputs, targets, kernel, settings, seed, reference)
    least = inputs.shape[1] + 2
    if settings.subset < least:
        raise ConfigError(f"A fit of {inputs.shape[1]} inputs needs a subset of {least}; found {settings.subset}.")
    subset = random_subset(len(inputs), settings.subset, seed)
    found = fit_hyperparameters(inputs[subset], targets[subset], settings.fit, seed, reference, near)
    if settings.iterations:
        centres = choose_inducing(inputs, found, settings.inducing, settings.tolerance)
        found = _refine(inputs, targets, centres, found, settings, reference, subset)
    centres = choose_inducing(inputs, found, settings.inducing, settings.tolerance)
    return condition_sparse(inputs, targets, centres, found)


def choose_inducing(inputs: Array, hyperparameters: Hyperparameters, count: int, tolerance: float) -> Array:
    """Rows of `inputs` (n, d) that leave the least variance unexplained, found greedily, (m ≤ count, d)."""

    def rows(pivot: int) -> Iterable[Array]:
        here, scales = inputs[pivot : pivot + 1], hyperparameters.length_scales
        return (squared_exponential(here, inputs, length_scales)[0] for length_scales in scales)

    gain = 0.5 * hyperparameters.signal_variance / hyperparameters.noise_variance
    return inputs[greedy_choice(rows, np.ones((len(gain), len(inputs))), gain, count, tolerance)]


def greedy_choice(
    rows: Callable[[int], Iterable[Array]], prior: Array, gain: Array, count: int, tolerance: float
) -> list[int]:
    """Numbers of the samples that leave the least variance unexplained, at most `count` and at least one.

    Each is the sample with the largest Σ_a v_a/(2σ_a²), v_a being output a's variance given those chosen before: its
    own part of what the bound loses (a pivoted Cholesky factorisation; Burt, Rasmussen and van der Wilk 2020).

    Args:
        rows: covariances of one sample with all, n of each output, in units of the output's largest variance.
        prior: (E, n) variances of the samples in these units.
        gain: (E,) half of these units over the noise variance.
        count: at most so many.
        tolerance: no more are chosen once all samples together lose less than this [nats].
    """
    (outputs, n), left = prior.shape, prior.copy()
    roots = np.zeros((outputs, min(count, n), n))
    chosen: list[int] = []
    while len(chosen) < min(count, n) and (not chosen or np.sum(gain @ left) > tolerance):
        pivot, step = int(np.argmax(gain @ left)), len(chosen)
        for a, row in enumerate(rows(pivot)):
            unexplained = row - roots[a, :step, pivot] @ roots[a, :step]
            roots[a, step] = unexplained / np.sqrt(left[a, pivot] + JITTER)
            left[a] = np.maximum(left[a] - roots[a, step] ** 2, 0.0)
        left[:, pivot] = 0.0
        chosen.append(pivot)
    return chosen


def random_subset(samples: int, count: int, seed: int) -> Integers:
    """Numbers of `count` of the samples, or of all, at random."""
    return generator(Stream.FIT_SUBSET, seed).permutation(samples)[:count]


def condition_sparse(inputs: Array, targets: Array, centres: Array, hyperparameters: Hyperparameters) -> GpFitResult:
    """Sparse posterior of E GPs with given hyper-parameters: inputs (n, d), targets (n, E), centres (m, d)."""
    posteriors = [
        Bound(inputs, target, centres).posterior(hyperparameters.theta(a)) for a, target in enumerate(targets.T)
    ]
    gp = GaussianProcess(
        centres,
        *hyperparameters,
        weights=np.array([posterior.weights for posterior in posteriors]),
        variance_matrix=np.array([posterior.variance_matrix for posterior in posteriors]),
        sample_root=np.array([posterior.sample_root for posterior in posteriors]),
    )
    return GpFitResult(gp, np.array([posterior.bound for posterior in posteriors]))


def _refine(
    inputs: Array,
    targets: Array,
    centres: Array,
    start: Hyperparameters,
    settings: SparseSettings,
    reference: PriorReference | None,
    subset: Integers,
) -> Hyperparameters:
    """Hyper-parameters moved by the bound on all samples, but for outputs that it knows too little of.

    Where the inducing inputs are too few for an output, its bound is highest where all is noise (Bauer, van der Wilk
    and Rasmussen 2016). The exact evidence of the subset tells: it falls by nats a sample there, else by hundredths.
    """

    def refined(output: int, objective: FitObjective) -> Array:
        theta, target = start.theta(output), targets[:, output]
        if not target.any():
            return theta
        bound, exact = Bound(inputs, target, centres), Evidence(inputs[subset], target[subset])
        moved = objective.minimise(bound, theta - objective.origin, settings.iterations).theta + objective.origin
        return moved if exact(theta)[0] - exact(moved)[0] < _LOSS * len(subset) else theta

    by_output = enumerate(objectives(inputs, targets, settings.fit, reference))
    return Hyperparameters.from_thetas(np.array(in_threads(lambda each: refined(*each), by_output)))
