"""The search for a GP's hyper-parameters, with the care that keeps such fits from going wrong."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from twbal.core.errors import ConfigError, FitError
from twbal.core.gaussian import Array
from twbal.core.streams import Stream, generator
from twbal.models.evidence import Evidence

Integers = NDArray[np.int64]

LogEvidence = Callable[[Array], tuple[float, Array]]
"""Log evidence of one output [nats], or a bound on it, and its gradient (d + 2,), at a θ of `Evidence`."""

PENALTY_POWER = 30  # PILCO's hypCurb: nearly nothing inside the limit, a wall beyond it
WALL = 1.25  # the search box, in units of the limits' logarithms; the penalty there is 1.25³⁰ = 800 nats
NOISE_BOX = (-25.0, 10.0)  # of log σ/std(y)
START_NOISE = 0.1  # σ/std(y)
MUTE_TARGET_SD = 1e-6  # stands for the spread of a target that is zero throughout
CURVATURE_STEP = 1e-2  # of the logarithms, in differences of slopes
FLATTEST = 1.0  # [nats]; the least curvature by which coordinates are scaled
FARTHEST = 30.0  # a polish's box, in units of the scaled coordinates: it only keeps exponentials from overflowing


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
        screening_points: with more samples than this, the starts are searched on a random choice of so many first ...
        finalists: ... on which they compete, and this many of the best are searched to the end on all samples.
        iterations: at most, of L-BFGS, in each search.
        max_signal_to_noise: α/σ above which the penalty rises.
        max_relative_length_scale: ℓ/std(X) above which the penalty rises.
        length_scale_prior: on ℓ relative to the reference length-scales; None for evidence alone.
        noise_prior: on σ relative to the reference noise; None for evidence alone.
        own_choices: above 0, so many starts do not compete: each is searched on a random choice of its own, and all of
            them then on all samples. A few samples often have one optimum where all of them have several, and which one
            differs from choice to choice.
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
    own_choices: int = 0

    def __post_init__(self) -> None:
        if min(self.starts, self.finalists, self.iterations, self.screening_points) < 1:
            raise ConfigError(f"starts, finalists, iterations and screening_points must be at least 1; found {self}.")
        if self.own_choices < 0:
            raise ConfigError(f"own_choices must be at least 0; found {self.own_choices}.")
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

    @classmethod
    def from_thetas(cls, thetas: Array) -> Self:
        """From the coordinates of E outputs, (E, d + 2)."""
        noise = np.exp(2.0 * thetas[:, -1])
        return cls(np.exp(thetas[:, :-2]), noise * np.exp(2.0 * thetas[:, -2]), noise)


class Objective:
    """What the search minimises: minus evidence, plus penalties, minus log prior, for one output.

    Its coordinates are those of `Evidence` less `origin`, so that they are 0 at ℓ = std(X), α/σ = 1 and σ = std(y).
    """

    def __init__(
        self, inputs: Array, target: Array, settings: FitSettings, length_scales: Array, noise_sd: float
    ) -> None:
        """Take the scales from the data, inputs (n, d) and target (n,); the priors are relative to the last two."""
        d = inputs.shape[1]
        self.origin = np.concatenate([np.log(spread(inputs)), [0.0, np.log(_target_spread(target))]])
        scale, ratio = np.log(settings.max_relative_length_scale), np.log(settings.max_signal_to_noise)
        self._limits = np.concatenate([np.full(d, scale), [ratio]])  # of |log ℓ| and |log α/σ|
        self._centre, self._precision = np.zeros(d + 2), np.zeros(d + 2)
        if settings.length_scale_prior:
            self._centre[:d] = np.log(length_scales) - self.origin[:d] + settings.length_scale_prior.log_mean
            self._precision[:d] = settings.length_scale_prior.log_sd**-2
        if settings.noise_prior:
            self._centre[-1] = np.log(noise_sd) - self.origin[-1] + settings.noise_prior.log_mean
            self._precision[-1] = settings.noise_prior.log_sd**-2

    def minimise(self, evidence: LogEvidence, start: Array, iterations: int) -> "Minimum":
        """Search with L-BFGS from `start` (d + 2,), in the coordinates of this objective."""
        bounds = [(-WALL * limit, WALL * limit) for limit in self._limits] + [NOISE_BOX]
        found = scipy.optimize.minimize(
            lambda theta: self._value(evidence, theta),
            np.clip(start, *np.transpose(bounds)),
            jac=True,
            method="L-BFGS-B",
            bounds=bounds,
            options={"maxiter": iterations, "maxcor": 20, "ftol": 1e-9, "gtol": 1e-3},
        )
        return Minimum(float(found.fun), found.x)

    def curvature(self, evidence: LogEvidence, theta: Array) -> Array:
        """Second derivatives at `theta` (d + 2,), by differences of slopes, (d + 2, d + 2)."""
        steps = CURVATURE_STEP * np.eye(len(theta))
        slopes = [self._value(evidence, theta + h)[1] - self._value(evidence, theta - h)[1] for h in steps]
        difference = np.array(slopes) / (2.0 * CURVATURE_STEP)
        return 0.5 * (difference + difference.T)

    def polish(self, evidence: LogEvidence, start: Array, curvature: Array, iterations: int) -> "Minimum":
        """Search with L-BFGS from `start` (d + 2,) near a minimum, in coordinates that make `curvature` about I.

        Length-scales and α/σ mostly rise together at little cost, so that curvatures differ a thousandfold: a search in
        such coordinates takes far fewer evaluations.
        """
        curvatures, axes = np.linalg.eigh(curvature)
        scale = axes / np.sqrt(np.maximum(np.abs(curvatures), FLATTEST))

        def value(z: Array) -> tuple[float, Array]:
            found, slope = self._value(evidence, start + scale @ z)
            return found, slope @ scale

        found = scipy.optimize.minimize(
            value,
            np.zeros_like(start),
            jac=True,
            method="L-BFGS-B",
            bounds=[(-FARTHEST, FARTHEST)] * len(start),
            options={"maxiter": iterations, "maxcor": 20, "ftol": 1e-7, "gtol": 1e-2},
        )
        return Minimum(float(found.fun), start + scale @ found.x)

    def _value(self, evidence: LogEvidence, theta: Array) -> tuple[float, Array]:
        value, slope = evidence(theta + self.origin)
        ratio = theta[:-1] / self._limits
        penalty_slope = np.append(PENALTY_POWER * ratio ** (PENALTY_POWER - 1) / self._limits, 0.0)
        away = theta - self._centre
        penalty = np.sum(ratio**PENALTY_POWER) + 0.5 * np.sum(self._precision * away**2)
        return float(penalty - value), penalty_slope + self._precision * away - slope


class Minimum(NamedTuple):
    """Where one search ended.

    Attributes:
        value: of the objective [nats].
        theta: (d + 2,), in the coordinates of the objective.
    """

    value: float
    theta: Array


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
    check_samples(inputs, targets)
    rng = generator(Stream.FIT_RESTARTS, seed)
    thetas = []
    for objective, target in zip(objectives(inputs, targets, settings, reference), targets.T, strict=True):
        thetas.append(_search(objective, inputs, target, settings, rng) + objective.origin)
    return Hyperparameters.from_thetas(np.array(thetas))


def objectives(inputs: Array, targets: Array, settings: FitSettings, reference: Reference | None) -> list[Objective]:
    """One objective an output, for inputs (n, d) and targets (n, E)."""
    if reference is None:
        noise_sd = np.array([_target_spread(target) for target in targets.T]) * START_NOISE
        reference = Reference(np.tile(spread(inputs), (targets.shape[1], 1)), noise_sd)
    return [
        Objective(inputs, target, settings, length_scales, float(noise_sd))
        for target, length_scales, noise_sd in zip(targets.T, *reference, strict=True)
    ]


def _search(
    objective: Objective, inputs: Array, target: Array, settings: FitSettings, rng: np.random.Generator
) -> Array:
    """The best of several searches, (d + 2,), in the coordinates of the objective."""
    n, d = inputs.shape
    start = np.append(np.zeros(d), np.log([1.0 / START_NOISE, START_NOISE]))
    moving = np.append(np.ptp(inputs, axis=0) > 0.0, [True, True])  # the data say nothing about the other inputs
    apart = n > settings.screening_points and settings.own_choices > 0
    count = settings.own_choices if apart else settings.starts
    away = settings.perturbation * rng.standard_normal((count, d + 2)) * moving
    chosen = rng.permutation(n)[: settings.screening_points]
    if not target.any():
        return start
    starts = np.vstack([start, start + away[1:]])
    if apart:
        choices = [chosen, *(rng.permutation(n)[: len(chosen)] for _ in starts[1:])]
        return _best_of_own_choices(objective, inputs, target, starts, choices, settings.iterations)
    if len(chosen) < n:
        screen = Evidence(inputs[chosen], target[chosen])
        results = [objective.minimise(screen, theta, settings.iterations) for theta in starts]
        results.sort(key=lambda minimum: minimum.value)
        starts = np.array([minimum.theta for minimum in results[: settings.finalists]])
    evidence = Evidence(inputs, target)
    results = [objective.minimise(evidence, theta, settings.iterations) for theta in starts]
    return min(results, key=lambda minimum: minimum.value).theta


def _best_of_own_choices(
    objective: Objective, inputs: Array, target: Array, starts: Array, choices: list[Integers], iterations: int
) -> Array:
    """The best of searches that each begin on a choice of samples and end on all, (d + 2,).

    An optimum on a few samples is near one on all of them, and has its curvature but for the number of samples.
    """
    evidence = Evidence(inputs, target)
    results = []
    for start, chosen in zip(starts, choices, strict=True):
        screen = Evidence(inputs[chosen], target[chosen])
        near = objective.minimise(screen, start, iterations).theta
        curvature = objective.curvature(screen, near) * (len(target) / len(chosen))
        results.append(objective.polish(evidence, near, curvature, iterations))
    return min(results, key=lambda minimum: minimum.value).theta


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


def check_samples(inputs: Array, targets: Array) -> None:
    """Raise FitError where GPs cannot be fitted to inputs (n, d) and targets (n, E)."""
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
