"""Kernels by name: an expression such as `matern52`, `se + linear` or `MaternKernel(nu=1.5) * periodic`.

Only names of kernels, sums, products and numbers are read; nothing in an expression is run.
"""

import ast
import inspect
from collections.abc import Mapping
from typing import Any

import gpytorch
import torch
from gpytorch.kernels import Kernel, LinearKernel, ScaleKernel
from linear_operator import to_dense

from twbal.core.errors import ConfigError

NAMES: Mapping[str, tuple[str, dict[str, float]]] = {
    "se": ("RBFKernel", {}),
    "matern12": ("MaternKernel", {"nu": 0.5}),
    "matern32": ("MaternKernel", {"nu": 1.5}),
    "matern52": ("MaternKernel", {"nu": 2.5}),
    "rq": ("RQKernel", {}),
    "linear": ("LinearKernel", {}),
    "quadratic": ("PolynomialKernel", {"power": 2}),
    "periodic": ("PeriodicKernel", {}),
    "compact": ("PiecewisePolynomialKernel", {"q": 2}),
}
"""Short names of kernels, with the arguments that they stand for."""

_LONGEST = 200  # characters of an expression
_LARGEST = 100  # number in it
_CHECKED = 20  # vectors at which a kernel is tried
_OF_GPYTORCH = "gpytorch.kernels."


def build(expression: str, inputs: int, *outputs: int) -> Kernel:
    """The kernel of a GP of several outputs, one set of parameters an output, all of them 1.

    Each summand has a scale α² of its own. A kernel with length-scales has one an input. Positive parameters are kept
    by their logarithms: GPyTorch's softplus loses digits where they are small.

    Args:
        expression: names of `NAMES` or of classes in `gpytorch.kernels`, with numbers as keyword arguments where they
            take some, joined by + and *.
        inputs: d.
        outputs: E, for a batch of so many kernels; none for a single one.

    Raises:
        ConfigError: it is no such expression, or no kernel of real inputs.
    """
    try:
        if len(expression) > _LONGEST:
            raise ValueError
        tree = ast.parse(expression.strip(), mode="eval").body
    except (SyntaxError, ValueError) as error:
        raise _refusal(expression, "it cannot be read") from error
    kernel = _Builder(expression, inputs, torch.Size(outputs)).scaled(tree).double()
    for part in list(kernel.modules()):
        _by_logarithms(part)
    _check(expression, kernel, inputs, outputs)
    return kernel


class DenseLinear(LinearKernel):  # type: ignore[misc]
    """As a matrix: in sums GPyTorch would factor the rest for the sake of its low rank, which needs more noise."""

    def forward(self, x1: torch.Tensor, x2: torch.Tensor, **options: Any) -> torch.Tensor:
        """x1ᵀ diag(v) x2."""
        dense: torch.Tensor = to_dense(super().forward(x1, x2, **options))
        return dense


class _Builder:
    """Makes kernels of the nodes of an expression."""

    def __init__(self, expression: str, inputs: int, batch: torch.Size) -> None:
        self._expression, self._inputs, self._batch = expression, inputs, batch

    def scaled(self, node: ast.expr) -> Kernel:
        """A sum of kernels, each with a scale."""
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
            return self.scaled(node.left) + self.scaled(node.right)
        return ScaleKernel(self._plain(node), batch_shape=self._batch)

    def _plain(self, node: ast.expr) -> Kernel:
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult):
            return self._plain(node.left) * self._plain(node.right)
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
            return self.scaled(node)
        if isinstance(node, ast.Call) and not node.args:
            return self._leaf(ast.unparse(node.func), dict(map(self._argument, node.keywords)))
        if isinstance(node, ast.Name | ast.Attribute):
            return self._leaf(ast.unparse(node), {})
        raise _refusal(self._expression, f"{ast.unparse(node)!r} is no kernel")

    def _argument(self, given: ast.keyword) -> tuple[str, float]:
        value = given.value.value if isinstance(given.value, ast.Constant) else None
        if given.arg is None or type(value) not in (int, float) or not abs(value) <= _LARGEST:  # type: ignore[arg-type]
            raise _refusal(self._expression, f"arguments are numbers up to {_LARGEST} by their names")
        return given.arg, value  # type: ignore[return-value]

    def _leaf(self, name: str, arguments: dict[str, float]) -> Kernel:
        class_name, defaults = NAMES.get(name, (name.removeprefix(_OF_GPYTORCH), {}))
        known = class_name in gpytorch.kernels.__all__ and class_name.endswith("Kernel")
        if not known:
            raise _refusal(self._expression, f"there is no kernel {name!r}")
        options, kind = {**defaults, **arguments}, getattr(gpytorch.kernels, class_name)
        kind = DenseLinear if kind is LinearKernel else kind
        shape = {"ard_num_dims": self._inputs, "batch_shape": self._batch}
        taken = inspect.signature(kind).parameters
        if "kwargs" not in taken:
            shape = {name: value for name, value in shape.items() if name in taken}
        try:
            return kind(**options, **shape)
        except (TypeError, ValueError, RuntimeError) as error:
            raise _refusal(self._expression, f"{class_name} cannot be made of {options} alone") from error


def _by_logarithms(kernel: Any) -> None:
    """Keep the positive parameters of one kernel, not of those within it, by their logarithms; all become 1."""
    for name, constraint in list(getattr(kernel, "_constraints", {}).items()):
        if type(constraint) is gpytorch.constraints.Positive:
            raw = name.removesuffix("_constraint")
            kernel.register_constraint(raw, positive())
            getattr(kernel, raw).data.zero_()


def positive() -> gpytorch.constraints.Positive:
    """A positive parameter, kept by its logarithm."""
    return gpytorch.constraints.Positive(transform=torch.exp, inv_transform=torch.log)


def _check(expression: str, kernel: Kernel, inputs: int, outputs: tuple[int, ...]) -> None:
    """Refuse what is no covariance of real inputs, with a row and a column for each input."""
    places = 3.0 * torch.linspace(0.0, 1e4, _CHECKED * inputs, dtype=torch.float64).sin().reshape(_CHECKED, inputs)
    try:
        with torch.no_grad():
            matrix = kernel(places, places).to_dense()
        eigenvalues = torch.linalg.eigvalsh(matrix)
        good = matrix.shape == (*outputs, _CHECKED, _CHECKED) and bool((eigenvalues > -1e-6 * eigenvalues.max()).all())
    except Exception as error:  # a kernel of other things than vectors may raise anything
        raise _refusal(expression, "it is no kernel of vectors of real numbers") from error
    if not good:
        raise _refusal(expression, f"it gives no covariance of vectors of {inputs} numbers")
    if any(not name.endswith("_bound") for name, _ in kernel.named_buffers()):
        raise _refusal(expression, "it is drawn at random")


def _refusal(expression: str, reason: str) -> ConfigError:
    return ConfigError(
        f"model.kernel={expression[:_LONGEST]!r} cannot be used: {reason}. Expected {', '.join(NAMES)}, or a class of "
        "gpytorch.kernels such as MaternKernel(nu=1.5), alone or in sums (+) and products (*)."
    )
