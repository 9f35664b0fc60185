"""Gaussian processes as they stand after the fit: arrays, a prediction, and nothing else."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
import scipy.linalg

from twbal.core.errors import FitError
from twbal.core.exponential import exp_in_place
from twbal.core.gaussian import Array
from twbal.core.lapack import factor, invert
from twbal.core.payload import Payload
from twbal.core.threads import in_threads

SQUARED_EXPONENTIAL = "se"
"""Name of the kernel that evidence and moment matching have closed forms for."""


class MarginalPrediction(NamedTuple):
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
    correlation: Array = a @ b.T
    correlation -= 0.5 * np.sum(a * a, axis=1)[:, None]
    correlation -= 0.5 * np.sum(b * b, axis=1)
    np.minimum(correlation, 0.0, out=correlation)
    exp_in_place(correlation.reshape(-1))
    return correlation


class Posterior(ABC):
    """E independent GPs, given data, over shared centres.

    mean_a(x) = k_a(x, C) β_a and variance_a(x) = k_a(x, x) - k_a(x, C) W_a k_a(C, x). For an exact GP the centres are
    the training inputs, β = K⁻¹y and W = K⁻¹ with the noise inside K (eq. 2, 3); a sparse one has its inducing inputs.

    Attributes:
        kernel: its name, or an expression of names (`models.kernels.expression`).
        centres: (n, d).
        noise_variance: (E,), σ² of one observation.
        weights: (E, n), β.
        variance_matrix: (E, n, n), W, symmetric.
        sample_root: (E, n, n), R with R Rᵀ = W - W K W, K being the prior covariance of the centres: how far a sampled
            function strays from the posterior mean. None: of an exact GP, where it is σ W.
    """

    kernel: str
    centres: Array
    noise_variance: Array
    weights: Array
    variance_matrix: Array
    sample_root: Array | None

    @property
    def outputs(self) -> int:
        """E, the number of GPs."""
        return len(self.weights)

    @property
    def inputs(self) -> int:
        """d, the number of input dimensions."""
        return int(self.centres.shape[1])

    @abstractmethod
    def covariances(self, inputs: Array) -> Iterator[Array]:
        """k_a(x, C) of each output in turn, (m, n), for inputs (m, d)."""

    @abstractmethod
    def prior_variance(self, inputs: Array) -> Array:
        """k_a(x, x) at inputs (m, d), (E, m) or (E, 1)."""

    @abstractmethod
    def slope(self, inputs: Array) -> Array:
        """Gradient of the posterior mean at `inputs` (m, d), (m, E, d)."""

    @abstractmethod
    def to_payload(self) -> dict[str, Any]:
        """Plain values and arrays from which the same GPs can be made."""

    def mean(self, inputs: Array) -> Array:
        """Posterior mean at `inputs` (m, d), eq. 2, (m, E)."""
        pairs = zip(self.covariances(np.atleast_2d(inputs)), self.weights, strict=True)
        return np.stack([k @ weights for k, weights in pairs], axis=1)

    def predict(self, inputs: Array) -> MarginalPrediction:
        """Mean and variance of the latent functions at `inputs` (m, d), eq. 2 and 3; noise is not in the variance."""
        inputs = np.atleast_2d(inputs)
        means, variances = [], []
        prior = self.prior_variance(inputs)
        for a, k in enumerate(self.covariances(inputs)):
            means.append(k @ self.weights[a])
            explained = np.einsum("mn,mn->m", k @ self.variance_matrix[a], k)
            variances.append(np.maximum(prior[a] - explained, 0.0))
        return MarginalPrediction(np.stack(means, axis=1), np.stack(variances, axis=1))

    def root(self, output: int) -> Array:
        """R of one output, (n, n)."""
        if self.sample_root is not None:
            return np.asarray(self.sample_root[output])
        return np.asarray(np.sqrt(self.noise_variance[output]) * self.variance_matrix[output])


@dataclass(frozen=True, eq=False)
class GaussianProcess(Posterior):
    """A posterior with the SE-ARD kernel of eq. 1.

    By hand, and the default: moment matching needs this kernel's closed forms, and they are several times faster.

    Attributes:
        length_scales: (E, d), ℓ in the inputs' units.
        signal_variance: (E,), α².
    """

    kernel: ClassVar[str] = SQUARED_EXPONENTIAL  # type: ignore[misc]
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

    def covariance(self, inputs: Array, output: int) -> Array:
        """k_a(x, C) of output `output`, (m, n), for inputs (m, d)."""
        correlation = squared_exponential(inputs, self.centres, self.length_scales[output])
        return correlation * float(self.signal_variance[output])

    def covariances(self, inputs: Array) -> Iterator[Array]:
        """k_a(x, C) of each output in turn, (m, n), for inputs (m, d)."""
        return (self.covariance(inputs, a) for a in range(self.outputs))

    def prior_variance(self, inputs: Array) -> Array:
        """α², (E, 1): the same at all inputs."""
        return self.signal_variance[:, None]

    def slope(self, inputs: Array) -> Array:
        """Gradient of the posterior mean at `inputs` (m, d), (m, E, d)."""
        inputs = np.atleast_2d(inputs)
        slopes = np.empty((len(inputs), self.outputs, self.inputs))
        for a in range(self.outputs):
            weighted = self.covariance(inputs, a) * self.weights[a]  # (m, n)
            towards = weighted @ self.centres - weighted.sum(axis=1)[:, None] * inputs  # (m, d)
            slopes[:, a] = towards / self.length_scales[a] ** 2
        return slopes

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

    def solved(a: int) -> tuple[Array, Array]:
        covariance = signal_variance[a] * squared_exponential(inputs, inputs, length_scales[a])
        covariance[np.diag_indices_from(covariance)] = signal_variance[a] + noise_variance[a]
        return solve(covariance, targets[:, a], a)

    weights, inverses = zip(*in_threads(solved, range(targets.shape[1])), strict=True)
    return GaussianProcess(
        inputs, length_scales, signal_variance, noise_variance, np.array(weights), np.array(inverses)
    )


def solve(covariance: Array, target: Array, output: int) -> tuple[Array, Array]:
    """β = K⁻¹y (n,) and K⁻¹ (n, n), symmetric, for K (n, n) with the noise in it and y (n,).

    Raises:
        FitError: K, of output `output`, is not positive definite, for want of noise.
    """
    held = np.array(covariance, order="F")
    if not factor(held):
        raise FitError(
            f"The covariance of output {output} is not positive definite; its variances are about "
            f"{np.median(np.diag(covariance)):.3g}. Lower the largest signal-to-noise ratio of the fit."
        )
    weights = scipy.linalg.cho_solve((held, True), target)
    invert(held)
    return weights, np.tril(held) + np.tril(held, -1).T
