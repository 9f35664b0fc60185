"""A policy with fewer basis functions that does nearly the same: for boards on which the whole one does not fit."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array
from twbal.policies.rbf import RbfPolicy
from twbal.policies.saved import SavedPolicy
from twbal.policies.squash import squash

_EVALUATIONS = 60  # of the fit, at most
_RIDGE = 1e-9


@dataclass(frozen=True)
class DistillationCost:
    """How far the smaller policy is from the whole one, at states that the fit did not see.

    Attributes:
        basis: functions that are left.
        former_basis: functions of the whole one that have a weight.
        rms_command: difference of the commands, as a share of the largest command.
        max_command: the largest one, likewise.
        rms_gain: difference of the gradients of the activation, as a share of its largest, channels in units of their
            working range.
    """

    basis: int
    former_basis: int
    rms_command: float
    max_command: float
    rms_gain: float


def distilled(policy: SavedPolicy, basis: int, states: Array) -> RbfPolicy:
    """The policy of `basis` functions whose commands are nearest at the states.

    It begins with those functions of the whole one that explain most of its radial part (orthogonal least squares;
    Chen, Cowan and Grant 1991), and then moves all of its parameters by least squares of the commands.

    Args:
        policy: with more basis functions.
        basis: how many are to be left, 0 or more.
        states: (n, D) at which it is to be the same.

    Raises:
        ConfigError: it is no network of basis functions, or has no more of them.
    """
    used = _checked(policy, basis)
    assert isinstance(policy, RbfPolicy)
    gaps = (states[:, None, :] - policy.centres[used]) / policy.lengths
    features = np.exp(-0.5 * (gaps**2).sum(axis=-1))
    linear = np.column_stack([np.ones(len(states)), states / policy.lengths])
    chosen = used[_orthogonal_choice(features, linear, features @ policy.weights[used], basis)]
    start = _Parameters(policy, policy.centres[chosen] / policy.lengths)
    target = policy.command(states) / policy.max_command
    first = start.with_linear_fit(states, policy.activation(states))
    fit = least_squares(
        lambda p: start.commands(p, states) - target,
        first,
        jac=lambda p: start.jacobian(p, states),
        max_nfev=_EVALUATIONS,
        x_scale="jac",
    )
    return start.policy(fit.x)


def cost_of(whole: RbfPolicy, smaller: RbfPolicy, states: Array, widths: Array) -> DistillationCost:
    """Compare both at states (n, D); `widths` (D,) are those of the working range."""
    off = (smaller.command(states) - whole.command(states)) / whole.max_command
    gradients = [_gradient(policy, states) * widths for policy in (whole, smaller)]
    return DistillationCost(
        basis=len(smaller.weights),
        former_basis=int(np.count_nonzero(whole.weights)),
        rms_command=float(np.sqrt(np.mean(off**2))),
        max_command=float(np.abs(off).max()),
        rms_gain=float(np.sqrt(np.mean((gradients[0] - gradients[1]) ** 2)) / np.abs(gradients[0]).max()),
    )


def _checked(policy: SavedPolicy, basis: int) -> np.ndarray:
    """Places of the basis functions that have a weight."""
    if not isinstance(policy, RbfPolicy):
        raise ConfigError(f"Only a policy of basis functions has fewer of them; found a {type(policy).__name__}.")
    used = np.flatnonzero(policy.weights)
    if not 0 <= basis < len(used):
        raise ConfigError(
            f"distil={basis} must be less than the {len(used)} basis functions that the policy has (others have no "
            "weight, and take no place)."
        )
    return used


def _orthogonal_choice(features: Array, linear: Array, target: Array, count: int) -> list[int]:
    """Columns of `features` that, one after the other, explain most of what is left of the target."""
    q, _ = np.linalg.qr(linear)
    left, columns = target - q @ (q.T @ target), features - q @ (q.T @ features)
    chosen: list[int] = []
    for _ in range(count):
        sizes = np.einsum("ij,ij->j", columns, columns)
        gains = np.where(sizes > _RIDGE * len(target), (left @ columns) ** 2 / np.maximum(sizes, 1e-300), -1.0)
        gains[chosen] = -2.0
        best = int(np.argmax(gains))
        chosen.append(best)
        direction = columns[:, best] / max(np.sqrt(sizes[best]), 1e-150)
        left = left - direction * (direction @ left)
        columns = columns - np.outer(direction, direction @ columns)
    return chosen


def _gradient(policy: RbfPolicy, states: Array) -> Array:
    """Of the activation by the state, (n, D)."""
    gaps = (states[:, None, :] - policy.centres) / policy.lengths
    terms = np.exp(-0.5 * (gaps**2).sum(axis=-1)) * policy.weights
    gradient: Array = policy.gain - np.einsum("ni,nid->nd", terms, gaps) / policy.lengths
    return gradient


class _Parameters:
    """Bias, gains, weights and centres as one vector, gains and centres in units of the lengths."""

    def __init__(self, policy: RbfPolicy, centres: Array) -> None:
        self._whole, self._first_centres = policy, centres
        self._count, self._width = centres.shape

    def with_linear_fit(self, states: Array, activation: Array) -> Array:
        """The vector of the first centres, with the linear parameters that fit the activation best."""
        z = states / self._whole.lengths
        features = np.exp(-0.5 * ((z[:, None, :] - self._first_centres) ** 2).sum(axis=-1))
        A = np.column_stack([np.ones(len(z)), z, features])
        size = np.sqrt((A**2).mean(axis=0)) + 1e-12
        solved = np.linalg.lstsq(A / size, activation, rcond=1e-10)[0] / size
        return np.concatenate([solved, self._first_centres.ravel()])

    def commands(self, vector: Array, states: Array) -> Array:
        """As shares of the largest command, (n,)."""
        policy = self.policy(vector)
        return squash(policy.activation(states), policy.compensation, policy.compensation_width)

    def jacobian(self, vector: Array, states: Array) -> Array:
        """Of `commands`, (n, P)."""
        policy = self.policy(vector)
        z = states / policy.lengths
        gaps = z[:, None, :] - policy.centres / policy.lengths  # (n, N, D)
        features = np.exp(-0.5 * (gaps**2).sum(axis=-1))
        by_centres = (features * policy.weights)[:, :, None] * gaps
        by_activation = np.column_stack([np.ones(len(z)), z, features, by_centres.reshape(len(z), -1)])
        a, h = policy.activation(states), 1e-6
        above, below = (squash(a + d, policy.compensation, policy.compensation_width) for d in (h, -h))
        slope = (above - below) / (2 * h)
        jacobian: Array = slope[:, None] * by_activation
        return jacobian

    def policy(self, vector: Array) -> RbfPolicy:
        """The policy of a vector."""
        bias, rest = float(vector[0]), vector[1:]
        gain, weights = rest[: self._width], rest[self._width : self._width + self._count]
        centres = rest[self._width + self._count :].reshape(self._count, self._width)
        lengths = self._whole.lengths
        return replace(self._whole, bias=bias, gain=gain / lengths, weights=weights, centres=centres * lengths)
