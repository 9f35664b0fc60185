"""The search for a GP's hyper-parameters, with the care that keeps such fits from going wrong."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.optimize

from twbal.errors import ConfigError, FitError
from twbal.gaussian import Array
from twbal.models.evidence import Evidence

PENALTY_POWER = 30  # PILCO's hypCurb: nearly nothing inside the limit, a wall beyond it
WALL = 1.25  # the search box, in units of the limits' logarithms; the penalty there is 1.25³⁰ = 800 nats
MUTE_TARGET_SD = 1e-6  # stands for the spread of a target that is zero throughout


@dataclass(frozen=True)
class LogNormalPrior:
    """Prior on a hyper-parameter's ratio to its reference: log(θ / reference) ~ N(log_mean, log_sd²).

    Attributes:
        log_mean: 0 means that the reference itself is the most likely.
        log_sd: 1 means within a factor of e.
    """

    log_mean: float
    log_sd: float

    def __post_init__(self) -> None:
        if not self.log_sd > 0:
            raise ConfigError(f"A prior's log_sd must be positive; found {self.log_sd}.")


@dataclass(frozen=True)
class FitSettings:
    """How hyper-parameters are searched.

    Attributes:
        starts: searches an output: the first from std(X), std(y), std(y)/10, the others from perturbations of that.
        perturbation: standard deviation of the starts' logarithms.
        screening_points: with more samples than this, the starts compete on a random choice of so many ...
        finalists: ... and this many of the best are searched to the end on all samples.
        iterations: at most, of L-BFGS, in each search.
        max_signal_to_noise: α/σ above which the penalty rises.
        max_relative_length_scale: ℓ/std(X) above which the penalty rises.
        length_scale_prior: on ℓ relative to the reference length-scales; None for evidence alone.
        noise_prior: on σ relative to the reference noise; None for evidence alone.
    """

    starts: int
    perturbation: float
    screening_points: int
    finalists: int
    iterations: int
    max_signal_to_noise: float
    max_relative_length_scale: float
    length_scale_prior: LogNormalPrior | None = None
    noise_prior: LogNormalPrior | None = None

    def __post_init__(self) -> None:
        if min(self.starts, self.finalists, self.iterations, self.screening_points) < 1:
            raise ConfigError(f"starts, finalists, iterations and screening_points must be at least 1; found {self}.")
        if min(self.max_signal_to_noise, self.max_relative_length_scale) <= 1:
            raise ConfigError(f"max_signal_to_noise and max_relative_length_scale must exceed 1; found {self}.")


class Reference(NamedTuple):
    """What the priors are relative to.

    Attributes:
        length_scales: (E, d), such as those of f for the difference model g.
        noise_sd: (E,), in the targets' units.
    """

    length_scales: Array
    noise_sd: Array


class Hyperparameters(NamedTuple):
    """Of E GPs.

    Attributes:
        length_scales: (E, d).
        signal_variance: (E,).
        noise_variance: (E,).
    """

    length_scales: Array
    signal_variance: Array
    noise_variance: Array

    def theta(self, output: int) -> Array:
        """One output's coordinates in `Evidence`, (d + 2,)."""
        noise = self.noise_variance[output]
        ratio = self.signal_variance[output] / noise
        return np.concatenate([np.log(self.length_scales[output]), 0.5 * np.log([ratio, noise])])


class _Objective:
    """Negative log posterior of one output's θ, in units where X and y have standard deviation 1."""

    def __init__(
        self, inputs: Array, target: Array, settings: FitSettings, length_scales: Array, noise_sd: float
    ) -> None:
        d = inputs.shape[1]
        self._evidence = Evidence(inputs, target)
        snr, scale = np.log(settings.max_signal_to_noise), np.log(settings.max_relative_length_scale)
        self._limits = np.concatenate([np.full(d, scale), [snr]])  # of |log ℓ| and |log α/σ|
        self._centre, self._precision = np.zeros(d + 2), np.zeros(d + 2)
        if settings.length_scale_prior:
            self._centre[:d] = np.log(length_scales) + settings.length_scale_prior.log_mean
            self._precision[:d] = settings.length_scale_prior.log_sd**-2
        if settings.noise_prior:
            self._centre[-1] = np.log(noise_sd) + settings.noise_prior.log_mean
            self._precision[-1] = settings.noise_prior.log_sd**-2

    @property
    def bounds(self) -> list[tuple[float, float]]:
        return [(-WALL * limit, WALL * limit) for limit in self._limits] + [(-25.0, 10.0)]

    def __call__(self, theta: Array) -> tuple[float, Array]:
        value, slope = self._evidence(theta)
        ratio = theta[:-1] / self._limits
        penalty_slope = np.append(PENALTY_POWER * ratio ** (PENALTY_POWER - 1) / self._limits, 0.0)
        away = theta - self._centre
        value -= np.sum(ratio**PENALTY_POWER) + 0.5 * np.sum(self._precision * away**2)
        return -value, -(slope - penalty_slope - self._precision * away)


def fit_hyperparameters(
    inputs: Array, targets: Array, settings: FitSettings, seed: int, reference: Reference | None = None
) -> Hyperparameters:
    """Hyper-parameters that maximise the evidence, less penalties and, where given, with priors.

    Args:
        inputs: (n, d), in any units.
        targets: (n, E).
        settings: how to search.
        seed: of the perturbed starts and of the samples that they compete on.
        reference: what the priors are relative to; None means std(X) and std(y)/10.

    Raises:
        FitError: too few samples, shapes that do not fit, a value that is not finite.
    """
    _check(inputs, targets)
    rng = np.random.default_rng(seed)
    input_sd = spread(inputs)
    centred = (inputs - inputs.mean(axis=0)) / input_sd
    moving = np.ptp(inputs, axis=0) > 0.0
    thetas, target_sds = [], []
    for a, target in enumerate(targets.T):
        target_sd = _target_spread(target)
        scales = np.ones(inputs.shape[1]) if reference is None else reference.length_scales[a] / input_sd
        noise_sd = 0.1 if reference is None else reference.noise_sd[a] / target_sd
        thetas.append(_search(centred, target / target_sd, settings, scales, noise_sd, moving, rng))
        target_sds.append(target_sd)
    theta = np.array(thetas)
    noise = np.exp(theta[:, -1]) * np.array(target_sds)
    signal = np.exp(theta[:, -2]) * noise
    return Hyperparameters(np.exp(theta[:, :-2]) * input_sd, signal**2, noise**2)


def spread(inputs: Array) -> Array:
    """Scale of each input, (d,): its standard deviation, or its size where it never changes."""
    size = np.abs(inputs).max(axis=0)
    still = np.where(size > 0.0, size, 1.0)
    return np.where(np.ptp(inputs, axis=0) > 0.0, inputs.std(axis=0), still)


def _target_spread(target: Array) -> float:
    """Standard deviation of a target, or its size where it never changes."""
    size = float(np.abs(target).max())
    deviation = float(target.std())
    return deviation if deviation > 1e-9 * size else (size or MUTE_TARGET_SD)


def _search(
    inputs: Array,
    target: Array,
    settings: FitSettings,
    length_scales: Array,
    noise_sd: float,
    moving: Array,
    rng: np.random.Generator,
) -> Array:
    """The best θ of several searches, (d + 2,), for data of standard deviation 1."""
    n, d = inputs.shape
    start = np.append(np.zeros(d), np.log([10.0, 0.1]))
    noise = rng.standard_normal((settings.starts, d + 2)) * np.append(moving, [1.0, 1.0])
    noise[0] = 0.0
    chosen = rng.permutation(n)[: settings.screening_points]
    if not target.any():
        return start
    starts = start + settings.perturbation * noise
    if len(chosen) < n:
        screen = _Objective(inputs[chosen], target[chosen], settings, length_scales, noise_sd)
        results = sorted((_minimise(screen, theta, settings) for theta in starts), key=lambda r: r.value)
        starts = np.array([r.theta for r in results[: settings.finalists]])
    objective = _Objective(inputs, target, settings, length_scales, noise_sd)
    return min((_minimise(objective, theta, settings) for theta in starts), key=lambda r: r.value).theta


class _Minimum(NamedTuple):
    value: float
    theta: Array


def _minimise(objective: _Objective, start: Array, settings: FitSettings) -> _Minimum:
    bounds = objective.bounds
    start = np.clip(start, *np.transpose(bounds))
    found = scipy.optimize.minimize(
        objective,
        start,
        jac=True,
        method="L-BFGS-B",
        bounds=bounds,
        options={"maxiter": settings.iterations, "maxcor": 20, "ftol": 1e-9, "gtol": 1e-3},
    )
    return _Minimum(float(found.fun), found.x)


def _check(inputs: Array, targets: Array) -> None:
    if inputs.ndim != 2 or targets.ndim != 2 or len(inputs) != len(targets):
        raise FitError(f"A fit needs inputs (n, d) and targets (n, E); found {inputs.shape} and {targets.shape}.")
    n, d = inputs.shape
    if n < d + 2:
        raise FitError(
            f"Too few samples to fit: found {n}, and {d} inputs need at least {d + 2}. Collect more or longer rollouts."
        )
    for name, values in (("inputs", inputs), ("targets", targets)):
        if not np.isfinite(values).all():
            row = int(np.argwhere(~np.isfinite(values))[0][0])
            raise FitError(f"Sample {row} of the {name} is not a finite number ({values[row]}). Leave it out.")
