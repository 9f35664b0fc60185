"""How the hyper-parameters of a GP are searched, whatever its kernel."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from twbal.core.errors import ConfigError, FitError
from twbal.core.gaussian import Array, Mask

MUTE_TARGET_SD = 1e-6  # stands for the spread of a target that is zero throughout
START_NOISE = 0.1  # σ/std(y)
_ROUNDING = 1e-9  # of the largest value; what varies less does so by rounding


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
        finalists: ... on which they compete, and so many different ends at most, the best, go on to all samples.
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


class PriorReference(NamedTuple):
    """What the priors are relative to.

    Attributes:
        length_scales: (E, d), such as those of f for the difference model g.
        noise_sd: (E,), in the targets' units.
    """

    length_scales: Array
    noise_sd: Array


def reference_of(inputs: Array, targets: Array) -> PriorReference:
    """What priors are relative to where nothing else is known: std(X) and std(y)/10."""
    noise_sd = np.array([target_scale(target) for target in targets.T]) * START_NOISE
    return PriorReference(np.tile(input_scales(inputs), (targets.shape[1], 1)), noise_sd)


def input_scales(inputs: Array) -> Array:
    """Scale of each input, (d,): its standard deviation, or its size where it never changes but for rounding."""
    size = np.abs(inputs).max(axis=0)
    still = np.where(size > 0.0, size, 1.0)
    return np.where(changing(inputs), inputs.std(axis=0), still)


def changing(inputs: Array) -> Mask:
    """Whether each input changes by more than rounding, (d,)."""
    is_wide = inputs.std(axis=0) > _ROUNDING * np.abs(inputs).max(axis=0)
    return np.asarray(is_wide & (np.ptp(inputs, axis=0) > 0.0))


def target_scale(target: Array) -> float:
    """Standard deviation of a target (n,), or its size where it never changes but for rounding."""
    size = float(np.abs(target).max())
    deviation = float(target.std())
    return deviation if deviation > _ROUNDING * size else (size or MUTE_TARGET_SD)


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
