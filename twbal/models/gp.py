"""Gaussian processes as they stand after the fit: arrays, a prediction, and nothing else."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, NamedTuple, Self

import numpy as np
import scipy.linalg

from twbal.core.errors import FitError
from twbal.core.gaussian import Array
from twbal.core.payload import Payload


class Prediction(NamedTuple):
    """Marginal predictions at m inputs.

    Attributes:
        mean: (m, E) in the targets' units.
        variance: (m, E), of the latent function: the noise variance is not in it.
    """

    mean: Array
    variance: Array


def squared_exponential(left: Array, right: Array, length_scales: Array) -> Array:
    """Correlation exp(-½ (x - x')ᵀ Λ⁻¹ (x - x')) of eq. 1, (n, m), between rows of (n, d) and (m, d)."""
    shift = left.mean(axis=0)  # distances are differences: centring only saves digits
    a, b = (left - shift) / length_scales, (right - shift) / length_scales
    exponent = a @ b.T - 0.5 * np.sum(a * a, axis=1)[:, None] - 0.5 * np.sum(b * b, axis=1)
    correlation: Array = np.exp(np.minimum(exponent, 0.0))
    return correlation


@dataclass(frozen=True, eq=False)
class GaussianProcess:
    """E independent GPs with an SE-ARD kernel (eq. 1) over shared centres.

    mean_a(x) = k_a(x, C) β_a and variance_a(x) = α_a² - k_a(x, C) W_a k_a(C, x). For an exact GP the centres are the
    training inputs, β = K⁻¹y and W = K⁻¹ with the noise inside K (eq. 2, 3); a sparse one has its inducing inputs.

    Attributes:
        centres: (n, d).
        length_scales: (E, d), ℓ in the inputs' units.
        signal_variance: (E,), α².
        noise_variance: (E,), σ² of one observation.
        weights: (E, n), β.
        variance_matrix: (E, n, n), W, symmetric.
        sample_root: (E, n, n), R with R Rᵀ = W - W K W, K being the prior covariance of the centres: how far a sampled
            function strays from the posterior mean (`FunctionSamples`). None: of an exact GP, where it is σ W.
    """

    centres: Array
    length_scales: Array
    signal_variance: Array
    noise_variance: Array
    weights: Array
    variance_matrix: Array
    sample_root: Array | None = None

    def __post_init__(self) -> None:
        for item in fields(self):
            if getattr(self, item.name) is not None:
                values = np.ascontiguousarray(getattr(self, item.name), dtype=np.float64)
                object.__setattr__(self, item.name, values)
        (n, d), e = self.centres.shape, len(self.signal_variance)
        shapes = {
            "length_scales": (e, d),
            "noise_variance": (e,),
            "weights": (e, n),
            "variance_matrix": (e, n, n),
            "sample_root": (e, n, n),
        }
        for name, shape in shapes.items():
            values = getattr(self, name)
            if values is not None and values.shape != shape:
                found = values.shape
                raise FitError(f"{e} GPs over {n} centres of {d} inputs need {name} of shape {shape}; found {found}.")

    @property
    def outputs(self) -> int:
        """E, the number of GPs."""
        return len(self.signal_variance)

    @property
    def inputs(self) -> int:
        """d, the number of input dimensions."""
        return int(self.centres.shape[1])

    def covariance(self, inputs: Array, output: int) -> Array:
        """k_a(x, C) of output `output`, (m, n), for inputs (m, d)."""
        correlation = squared_exponential(inputs, self.centres, self.length_scales[output])
        return correlation * float(self.signal_variance[output])

    def mean(self, inputs: Array) -> Array:
        """Posterior mean at `inputs` (m, d), eq. 2, (m, E)."""
        inputs = np.atleast_2d(inputs)
        return np.stack([self.covariance(inputs, a) @ self.weights[a] for a in range(self.outputs)], axis=1)

    def slope(self, inputs: Array) -> Array:
        """Gradient of the posterior mean at `inputs` (m, d), (m, E, d)."""
        inputs = np.atleast_2d(inputs)
        slopes = np.empty((len(inputs), self.outputs, self.inputs))
        for a in range(self.outputs):
            weighted = self.covariance(inputs, a) * self.weights[a]  # (m, n)
            towards = weighted @ self.centres - weighted.sum(axis=1)[:, None] * inputs  # (m, d)
            slopes[:, a] = towards / self.length_scales[a] ** 2
        return slopes

    def predict(self, inputs: Array) -> Prediction:
        """Mean and variance of the latent functions at `inputs` (m, d), eq. 2 and 3; noise is not in the variance."""
        inputs = np.atleast_2d(inputs)
        means, variances = [], []
        for a in range(self.outputs):
            k = self.covariance(inputs, a)
            means.append(k @ self.weights[a])
            explained = np.einsum("mn,mn->m", k @ self.variance_matrix[a], k)
            variances.append(np.maximum(self.signal_variance[a] - explained, 0.0))
        return Prediction(np.stack(means, axis=1), np.stack(variances, axis=1))

    def to_payload(self) -> dict[str, Any]:
        """Plain arrays from which `from_payload` makes the same GPs."""
        arrays = {item.name: getattr(self, item.name) for item in fields(self)}
        return {name: values for name, values in arrays.items() if values is not None}

    @classmethod
    def from_payload(cls, payload: Mapping[str, Any]) -> Self:
        """The GPs that `to_payload` described.

        Raises:
            CheckpointError: an array is missing, of a shape that does not fit the others, or not finite.
        """
        found = Payload("GP", payload)
        centres = found.numbers("centres", (-1, -1))
        length_scales = found.numbers("length_scales", (-1, centres.shape[1]), np.finfo(float).tiny)
        n, E = len(centres), len(length_scales)
        return cls(
            centres=centres,
            length_scales=length_scales,
            signal_variance=found.numbers("signal_variance", (E,), 0.0),
            noise_variance=found.numbers("noise_variance", (E,), 0.0),
            weights=found.numbers("weights", (E, n)),
            variance_matrix=found.numbers("variance_matrix", (E, n, n)),
            sample_root=found.numbers("sample_root", (E, n, n)) if "sample_root" in found.names else None,
        )


def condition(
    inputs: Array, targets: Array, length_scales: Array, signal_variance: Array, noise_variance: Array
) -> GaussianProcess:
    """Exact posterior of E GPs with given hyper-parameters, eq. 2 and 3.

    Args:
        inputs: (n, d).
        targets: (n, E).
        length_scales: (E, d).
        signal_variance: (E,).
        noise_variance: (E,).

    Raises:
        FitError: a covariance matrix is not positive definite, for want of noise.
    """
    weights, inverses = [], []
    for a, target in enumerate(targets.T):
        covariance = signal_variance[a] * squared_exponential(inputs, inputs, length_scales[a])
        covariance[np.diag_indices_from(covariance)] = signal_variance[a] + noise_variance[a]
        try:
            factor = scipy.linalg.cho_factor(covariance, lower=True)
        except np.linalg.LinAlgError as error:
            raise FitError(
                f"The covariance of output {a} is not positive definite at signal variance {signal_variance[a]:.3g} "
                f"and noise variance {noise_variance[a]:.3g}. Lower the largest signal-to-noise ratio of the fit."
            ) from error
        inverse = scipy.linalg.cho_solve(factor, np.eye(len(inputs)))
        weights.append(scipy.linalg.cho_solve(factor, target))
        inverses.append(0.5 * (inverse + inverse.T))
    return GaussianProcess(
        inputs, length_scales, signal_variance, noise_variance, np.array(weights), np.array(inverses)
    )
