"""A GP posterior with any kernel of GPyTorch."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
import torch
from gpytorch.kernels import Kernel

from twbal.core.errors import CheckpointError, ConfigError
from twbal.core.gaussian import Array
from twbal.core.payload import Payload
from twbal.models.gp import Posterior
from twbal.models.kernels.expression import build


@dataclass(frozen=True, eq=False)
class KernelProcess(Posterior):
    """A posterior with k_a(x, x') = s_a² κ_a(x / h, x' / h), κ being a kernel of GPyTorch.

    Attributes:
        kernel: expression of κ (`models.kernels.expression`).
        parameters: of κ by their names in GPyTorch, each (E, ...).
        input_scales: h (d,), so that κ sees inputs around 1.
        target_scales: s (E,).
    """

    kernel: str
    parameters: Mapping[str, Array]
    input_scales: Array
    target_scales: Array
    centres: Array
    noise_variance: Array
    weights: Array
    variance_matrix: Array
    sample_root: Array | None = None

    def over(self, centres: Array) -> Self:
        """The same prior with other centres (n, d), at which nothing is known yet."""
        E, n = self.outputs, len(centres)
        return replace(self, centres=centres, weights=np.zeros((E, n)), variance_matrix=np.zeros((E, n, n)))

    @cached_property
    def module(self) -> Kernel:
        """κ of all outputs, whose parameters nobody changes any more."""
        kernel = build(self.kernel, self.inputs, self.outputs)
        set_parameters(kernel, self.parameters)
        return kernel.requires_grad_(False)

    @cached_property
    def scaled_centres(self) -> torch.Tensor:
        """C / h, (n, d)."""
        return torch.tensor(self.centres / self.input_scales)

    @cached_property
    def tensors(self) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """h (d,), s² (E, 1, 1) and β (E, n)."""
        squares = torch.tensor(self.target_scales**2)
        return torch.tensor(self.input_scales), squares[:, None, None], torch.tensor(self.weights)

    def cross(self, inputs: torch.Tensor) -> torch.Tensor:
        """k_a(x, C) of all outputs, (E, m, n), for inputs (m, d)."""
        scales, squares, _ = self.tensors
        covariance: torch.Tensor = self.module(inputs / scales, self.scaled_centres).to_dense()
        return covariance * squares

    def mean_tensor(self, inputs: torch.Tensor) -> torch.Tensor:
        """Posterior mean at inputs (m, d), (m, E), that PyTorch can differentiate."""
        return torch.einsum("emn,en->me", self.cross(inputs), self.tensors[2])

    def covariances(self, inputs: Array) -> Iterator[Array]:
        """k_a(x, C) of each output in turn, (m, n), for inputs (m, d)."""
        with torch.no_grad():
            return iter(self.cross(torch.tensor(inputs)).numpy())

    def prior_variance(self, inputs: Array) -> Array:
        """k_a(x, x) at inputs (m, d), (E, m)."""
        with torch.no_grad():
            variance = self.module(torch.tensor(inputs / self.input_scales), diag=True)
        return np.asarray(variance.numpy() * self.target_scales[:, None] ** 2)

    def slope(self, inputs: Array) -> Array:
        """Gradient of the posterior mean at `inputs` (m, d), (m, E, d), by automatic differentiation."""
        at = torch.tensor(np.atleast_2d(inputs), requires_grad=True)
        totals = self.mean_tensor(at).sum(dim=0)
        slopes = [torch.autograd.grad(total, at, retain_graph=True)[0] for total in totals]
        return np.asarray(torch.stack(slopes, dim=1).numpy())

    def to_payload(self) -> dict[str, Any]:
        """Plain values and arrays from which `from_payload` makes the same GPs."""
        values = {item.name: getattr(self, item.name) for item in fields(self)}
        values["parameters"] = dict(self.parameters)
        return {name: value for name, value in values.items() if value is not None}

    @classmethod
    def from_payload(cls, payload: Mapping[str, Any]) -> Self:
        """The GPs that `to_payload` described.

        Raises:
            CheckpointError: the kernel is none, or an array is missing, not finite, or does not fit the others.
        """
        found = Payload("GP", payload)
        centres, weights = found.numbers("centres", (-1, -1)), found.numbers("weights", (-1, -1))
        (n, d), E, kernel = centres.shape, len(weights), found.text("kernel")
        try:
            module = build(kernel, d, E)
        except ConfigError as error:
            raise CheckpointError(f"The GP's kernel cannot be made: {error}") from error
        given = found.part("parameters")
        return cls(
            kernel=kernel,
            parameters={name: given.numbers(name, tuple(raw.shape)) for name, raw in module.named_parameters()},
            input_scales=found.numbers("input_scales", (d,), np.finfo(float).tiny),
            target_scales=found.numbers("target_scales", (E,), np.finfo(float).tiny),
            centres=centres,
            noise_variance=found.numbers("noise_variance", (E,), 0.0),
            weights=found.numbers("weights", (E, n)),
            variance_matrix=found.numbers("variance_matrix", (E, n, n)),
            sample_root=found.numbers("sample_root", (E, n, n)) if "sample_root" in found.names else None,
        )


def prior_process(
    kernel: str, parameters: Mapping[str, Array], input_scales: Array, target_scales: Array, noise_variance: Array
) -> KernelProcess:
    """GPs that no data are known of; see `KernelProcess`."""
    d, E = len(input_scales), len(target_scales)
    nothing = np.zeros((0, d)), noise_variance, np.zeros((E, 0)), np.zeros((E, 0, 0))
    return KernelProcess(kernel, parameters, input_scales, target_scales, *nothing)


def set_parameters(kernel: Kernel, parameters: Mapping[str, Array]) -> None:
    """Give a kernel its parameters by their names, each of the shape that it has."""
    for name, raw in kernel.named_parameters():
        raw.data = torch.tensor(parameters[name], dtype=torch.float64).reshape(raw.shape)
