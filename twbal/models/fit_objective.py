"""What a search of hyper-parameters minimises, and how: scipy's L-BFGS-B from one start."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy.optimize

from twbal.core.gaussian import Array
from twbal.models.fit_settings import FitSettings, input_scales, target_scale

LogEvidence = Callable[[Array], tuple[float, Array]]
"""Log evidence of one output [nats], or a bound on it, and its gradient (d + 2,), at a θ of `Evidence`."""

PENALTY_POWER = 30  # PILCO's hypCurb: nearly nothing inside the limit, a wall beyond it
WALL = 1.25  # the search box, in units of the limits' logarithms; the penalty there is 1.25³⁰ = 800 nats
NOISE_BOX = (-25.0, 10.0)  # of log σ/std(y)
CURVATURE_STEP = 1e-2  # of the logarithms, in differences of slopes
FLATTEST = 1.0  # [nats]; the least curvature by which coordinates are scaled
FARTHEST = 30.0  # a polish's box, in units of the scaled coordinates: it only keeps exponentials from overflowing


class Minimum(NamedTuple):
    """Where one search ended.

    Attributes:
        value: of the objective [nats].
        theta: (d + 2,), in the coordinates of the objective.
    """

    value: float
    theta: Array


class FitObjective:
    """What the search minimises: minus evidence, plus penalties, minus log prior, for one output.

    Its coordinates are those of `Evidence` less `origin`, so that they are 0 at ℓ = std(X), α/σ = 1 and σ = std(y).
    """

    def __init__(
        self, inputs: Array, target: Array, settings: FitSettings, length_scales: Array, noise_sd: float
    ) -> None:
        """Take the scales from the data, inputs (n, d) and target (n,); the priors are relative to the last two."""
        d = inputs.shape[1]
        self.origin = np.concatenate([np.log(input_scales(inputs)), [0.0, np.log(target_scale(target))]])
        scale, ratio = np.log(settings.max_relative_length_scale), np.log(settings.max_signal_to_noise)
        self._limits = np.concatenate([np.full(d, scale), [ratio]])  # of |log ℓ| and |log α/σ|
        self._centre, self._precision = np.zeros(d + 2), np.zeros(d + 2)
        if settings.length_scale_prior:
            self._centre[:d] = np.log(length_scales) - self.origin[:d] + settings.length_scale_prior.log_mean
            self._precision[:d] = settings.length_scale_prior.log_sd**-2
        if settings.noise_prior:
            self._centre[-1] = np.log(noise_sd) - self.origin[-1] + settings.noise_prior.log_mean
            self._precision[-1] = settings.noise_prior.log_sd**-2

    def minimise(self, evidence: LogEvidence, start: Array, iterations: int) -> Minimum:
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

    def polish(self, evidence: LogEvidence, start: Array, curvature: Array, iterations: int) -> Minimum:
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
