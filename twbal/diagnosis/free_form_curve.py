"""The curve of a free-form effect with its band, its shape in words, and what it explains of held-out data."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array, Mask
from twbal.diagnosis.filter_result import with_offsets
from twbal.diagnosis.free_form_candidates import FreeFormCandidate, values_of
from twbal.diagnosis.free_form_shape import shape_of
from twbal.diagnosis.linear_errors import LinearErrors, linear_errors
from twbal.sysid.intervals import NORMAL95
from twbal.sysid.kalman import Filter, LinearPlanarModel
from twbal.sysid.likelihood import weights_of
from twbal.sysid.model import Data, FreeParameter, Model, Offsets
from twbal.sysid.smooth_function import Smooth
from twbal.sysid.smooth_regression import PriorFit, Projected, Weights, posterior_weights

_AHEAD = 0.15  # s over which predictions are held against each other, as of the headline of a gap
_POINTS = 61  # of the drawn function
_EDGE = 0.005  # share of the data beyond either end of what is drawn
_BLOCK = 1.0  # s; length of blocks that are taken to be independent


class Fitted(NamedTuple):
    """A candidate at its best.

    Attributes:
        candidate: which.
        at: errors that it is to explain.
        functions: of its variable.
        left: errors that their weights leave.
        found: what the errors say of the weights.
        evidence: for it, at its best length and size.
    """

    candidate: FreeFormCandidate
    at: LinearErrors
    functions: Smooth
    left: list[Array]
    found: Projected
    evidence: PriorFit

    def weights(self, dispersion: float) -> Weights:
        """Of its functions, after the data."""
        return posterior_weights(self.found, self.evidence.prior, dispersion)

    def moved(self, weights: Array) -> Array:
        """By how much free values and constants move from their priors' means."""
        return self.found.moved + self.found.shift @ weights

    def corrected(self, dispersion: float) -> list[Array]:
        """Errors that it leaves."""
        weights = self.weights(dispersion).mean
        return self.at.corrected(self.left, weights, self.moved(weights))


class Curve(NamedTuple):
    """A function where the data support it.

    Attributes:
        grid: (n,) values of the variable.
        mean: (n,) of the function, less its mean over the data.
        error: (n,) its standard error.
        shape: in words.
    """

    grid: Array
    mean: Array
    error: Array
    shape: str

    @property
    def low95(self) -> Array:
        """(n,) lower ends of 95 % intervals."""
        return np.asarray(self.mean - NORMAL95 * self.error)

    @property
    def high95(self) -> Array:
        """(n,) upper ends."""
        return np.asarray(self.mean + NORMAL95 * self.error)


def drawn(fitted: Fitted, dispersion: float, form: float) -> Curve:
    """The function over the range of the data.

    Its error is that of the posterior or of the sandwich, which comes from how the slopes scatter over blocks of the
    data (as in `sysid.intervals`), whichever is wider; and with it a share of the function's size.

    Args:
        fitted: the function.
        dispersion: that it leaves.
        form: that share.
    """
    data, candidate, weights = fitted.at.data, fitted.candidate, fitted.weights(dispersion)
    values = values_of(fitted.at.courses[candidate.variable], data.usable, candidate.is_periodic)
    low, high = (0.0, 2.0 * np.pi) if candidate.is_periodic else np.quantile(values, [_EDGE, 1.0 - _EDGE]).tolist()
    grid = np.linspace(low, high, _POINTS)
    at = fitted.functions.at(grid)
    if candidate.is_beside_line:
        lines = np.polynomial.polynomial.polyfit(values, fitted.functions.at(values), 1)  # (2, m)
        at -= lines[0] + grid[:, None] * lines[1]
    variances = [
        np.einsum("im,mk,ik->i", at, C, at) for C in (weights.covariance, _sandwich(fitted, weights, dispersion))
    ]
    mean = at @ weights.mean
    error = np.sqrt(np.maximum(*variances) + np.mean((form * mean) ** 2))
    return Curve(grid, mean, error, shape_of(grid, mean, candidate.is_periodic))


def _sandwich(fitted: Fitted, weights: Weights, dispersion: float) -> Array:
    """Covariance (m, m) of the weights by how their slopes scatter over blocks of the data."""
    J, y = fitted.at.white_slopes
    A = fitted.at.white(fitted.left)
    left = y - A @ weights.mean + J @ fitted.moved(weights.mean)
    own = A - J @ fitted.found.shift
    per_block = 4 * max(round(_BLOCK / fitted.at.data.period), 1)
    starts = np.arange(0, len(left), per_block)
    pulls = np.add.reduceat(own * left[:, None], starts, axis=0)  # (B, m)
    pulls -= pulls.mean(axis=0)
    inverse = weights.covariance / dispersion
    return np.asarray(inverse @ (pulls.T @ pulls) @ inverse * len(starts) / max(len(starts) - 1, 1))


def held_out_share(
    fitted: Fitted,
    before: Model,
    kept_back: Data,
    offsets: tuple[Offsets, ...] | Sequence[FreeParameter],
    dispersion: float,
) -> float:
    """Share of the mean square error of predictions over about 0.15 s on held-out data that goes with it.

    Of the tilt, or of the wheel angle where no tilt was measured; where the variable stays within the range of the data
    that the function was fitted to. Predictions are those of a filter, carried on by the linear model; both with the
    noise of the set without the function.

    Args:
        fitted: the function.
        before: the set of effects as it was fitted.
        kept_back: recordings that nothing was fitted to.
        offsets: of these recordings, or what is free of them.
        dispersion: that the function leaves.
    """
    weights = fitted.weights(dispersion).mean
    moved = fitted.moved(weights)
    plain = with_offsets(kept_back, before, offsets)
    kalman, linear = kept_back.filter(plain), kept_back.linear(plain)
    errors = kept_back.errors(plain, kalman)
    model = with_offsets(kept_back, fitted.at.moved(moved)._replace(noise=before.noise), offsets)
    at = linear_errors(kept_back, model, (), kalman, weights_of(errors, kept_back.usable, kalman))
    constants = (moved + fitted.at.off)[len(fitted.at.free_parameters) :]
    left = at.left_by(fitted.candidate, fitted.functions)
    corrected = [e - A @ weights + J @ constants for e, A, J in zip(at.errors, left, at.slopes, strict=True)]
    steps = max(round(_AHEAD / kept_back.period), 1)
    channel = 0 if kept_back.sensed[0] else 2
    squares = [0.0, 0.0]
    for number, course in enumerate(at.courses[fitted.candidate.variable]):
        counts = (kept_back.usable[number] & _stays(fitted.functions.covers(course.at), 2 * steps))[steps:]
        for k, these in enumerate((errors, corrected)):
            ahead = _ahead(these[number], linear, kalman, steps)[:, channel]
            squares[k] += float((ahead[counts] ** 2).sum())
    return 1.0 - squares[1] / squares[0] if squares[0] > 0.0 else 0.0


def _stays(inside: Mask, count: int) -> Mask:
    """Where a variable has been inside for so many instants (T + 1,)."""
    outside = np.cumsum(~inside)
    return np.asarray(outside == np.concatenate([np.full(min(count, len(outside)), 0), outside])[: len(outside)])


def _ahead(errors: Array, linear: LinearPlanarModel, kalman: Filter, steps: int) -> Array:
    """Errors (T + 1 - steps, 4) of predictions so many control periods ahead, from those one period ahead (T + 1, 4).

    In the innovations form: e_n + Σ_j C F^j K e_{n-j}, over j = 1 .. steps - 1.
    """
    found = errors[steps:].copy()
    carried = linear.F @ kalman.gains[-1]
    for j in range(1, steps):
        found += errors[steps - j : len(errors) - j] @ (linear.C @ carried).T
        carried = linear.F @ carried
    return np.asarray(found)
