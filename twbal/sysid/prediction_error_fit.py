"""Prediction-error fits: the values under which the recordings are likeliest, with a prior on some of them."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import lsq_linear

from twbal.core.gaussian import Array
from twbal.sysid.kalman import Filter
from twbal.sysid.model import Data, Field, FreeParameter, LogOffset, Model
from twbal.sysid.noise import NoiseModel

_FIRST_DAMPING, _LAST_DAMPING = 1e-8, 1e4
_SETTLED = 0.02  # gain in cost [2 nats] below which a fit is done
_CONVERGED = 0.5  # gain of a round [2 nats] below which values and noise have settled
_NOISE_STEPS = (1.0, 0.5, 0.25, 0.125)  # shares of the way to the fitted noise, tried until one gains
_RIDGE = 1e-4  # against values that the recordings do not bear on, in units of their ranges


class Fit(NamedTuple):
    """A fitted model.

    Attributes:
        model: with the fitted values in it.
        free_parameters: what was free.
        cost: -2 log likelihood and log prior, but for a constant; of `descend`, without the filter's determinants.
        kalman: the filter that made its prediction errors: that of the model which this fit began from.
        white: whitened prediction errors, flat (N,).
    """

    model: Model
    free_parameters: tuple[FreeParameter, ...]
    cost: float
    kalman: Filter
    white: Array

    @property
    def values(self) -> Array:
        """(P,) fitted values."""
        return np.array([self.model.value(free.field) for free in self.free_parameters])


def penalty(free_parameters: Sequence[FreeParameter], values: Array) -> float:
    """-2 log prior of free values, but for a constant."""
    means, sds = np.array([free.mean for free in free_parameters]), np.array([free.sd for free in free_parameters])
    return float((((values - means) / sds) ** 2).sum())


def slopes(data: Data, model: Model, kalman: Filter, free_parameters: Sequence[FreeParameter], white: Array) -> Array:
    """Derivatives of the whitened errors by free values, (N, P): differences forward, or backward at a bound.

    An offset bears on one recording alone, so those of one kind are moved in all recordings at once. Where predictions
    diverge a nudge away, the difference to the other side is taken, and none where they do on both; where they diverge
    without a nudge, nothing is a number.
    """
    if not np.isfinite(white).all():
        return np.full((len(white), len(free_parameters)), np.nan)
    columns = np.empty((len(white), len(free_parameters)))
    ends = 4 * np.cumsum([0, *(len(recording) for recording in data.recordings)])
    offsets: dict[str, list[tuple[int, LogOffset, float]]] = {}
    for i, free in enumerate(free_parameters):
        value = model.value(free.field)
        nudge = free.nudge if value + free.nudge <= free.high else -free.nudge
        if isinstance(free.field, LogOffset):
            offsets.setdefault(free.field.kind, []).append((i, free.field, nudge))
        else:
            columns[:, i] = _change(data, model, kalman, {free.field: nudge}, white) / nudge
    apart = model.apart
    for these in offsets.values():
        change = _change(data, apart, kalman, {field: nudge for _, field, nudge in these}, white)
        for _, field, nudge in these:
            change[slice(*ends[field.recording : field.recording + 2])] /= nudge
        for i, field, _ in these:
            shares = [model.share(field, recording) for recording in range(len(data.recordings))]
            columns[:, i] = np.repeat(shares, np.diff(ends)) * change
    return columns


def _change(data: Data, model: Model, kalman: Filter, nudges: Mapping[Field, float], white: Array) -> Array:
    """What nudges of values change in the whitened errors, by those to the other side where predictions diverge."""
    for side in (1.0, -1.0):
        moved = model.put({field: model.value(field) + side * nudge for field, nudge in nudges.items()})
        found = side * (data.white(moved, kalman) - white)
        if np.isfinite(found).all():
            return found
    return np.zeros_like(white)


def slopes_of(data: Data, fit: Fit) -> Array:
    """Derivatives of a fit's whitened errors by what is free in it, (N, P).

    With its own filter: that of the fitted model makes other errors, and a finite difference between the two is all
    filter and no derivative.
    """
    return slopes(data, fit.model, fit.kalman, fit.free_parameters, fit.white)


def descend(
    data: Data,
    model: Model,
    kalman: Filter,
    free_parameters: Sequence[FreeParameter],
    iterations: int,
    known: Array | None = None,
) -> Fit:
    """Levenberg-Marquardt within bounds, with the noise and the filter as they are.

    The steps are scipy's bounded linear least squares, the damping is our own. In the 205 fits of a diagnosis,
    `scipy.optimize.least_squares` with as many steps ended with a cost higher by more than 0.5 in 25 (`dogbox`, which
    meets one bound a step) or 39 (`trf`, whose steps the bounds shorten), and took 1.4 times as long; with three times
    as many, in 17 or 2, and twice as long.

    Args:
        data: recordings.
        model: where the search begins.
        kalman: the filter.
        free_parameters: what is free.
        iterations: at most; none where predictions diverge. The cost is infinite where they do at `model`.
        known: slopes by the first of them, (N, K), which are taken to be the same everywhere; None: all are computed.
    """
    sds = np.array([free.sd for free in free_parameters])
    means = np.array([free.mean for free in free_parameters])
    low, high = np.array([free.low for free in free_parameters]), np.array([free.high for free in free_parameters])
    names = [free.field for free in free_parameters]
    x = np.clip([model.value(name) for name in names], low, high)
    model = model.put(dict(zip(names, x.tolist(), strict=True)))
    white = data.white(model, kalman)
    best = _cost(white, free_parameters, x)
    damping, begin = _FIRST_DAMPING, 0 if known is None else known.shape[1]
    for _ in range(iterations):
        J = slopes(data, model, kalman, free_parameters[begin:], white)
        J = J if known is None else np.hstack([known, J])
        if not np.isfinite(J).all():  # predictions diverge, here or a nudge from here
            break
        H = J.T @ J + np.diag(1.0 / sds**2 + _RIDGE / (high - low) ** 2)
        gradient = J.T @ white + (x - means) / sds**2
        gained = 0.0
        while damping < _LAST_DAMPING:
            trial = _step(x, gradient, H, damping, low, high)
            moved = model.put(dict(zip(names, trial.tolist(), strict=True)))
            after = data.white(moved, kalman)
            value = _cost(after, free_parameters, trial)
            if value < best:
                gained, best, x, model, white = best - value, value, trial, moved, after
                damping = max(0.01 * damping, _FIRST_DAMPING)
                break
            damping *= 100.0
            if np.abs((trial - x) / (high - low)).max() < 1e-7:
                break
        if gained < _SETTLED:
            break
    return Fit(model, tuple(free_parameters), best, kalman, white)


def _cost(white: Array, free_parameters: Sequence[FreeParameter], x: Array) -> float:
    """-2 log posterior but for a constant; infinite where predictions diverge."""
    found = float(white @ white) + penalty(free_parameters, x)
    return found if np.isfinite(found) else np.inf


def _step(x: Array, gradient: Array, H: Array, damping: float, low: Array, high: Array) -> Array:
    """Where a damped Newton step within the bounds ends."""
    R = cholesky(H + damping * np.diag(np.diag(H)))
    found = lsq_linear(R, solve_triangular(R, -gradient, trans="T"), (low - x, high - x), method="bvls")
    at_low, at_high = found.active_mask < 0, found.active_mask > 0
    return np.clip(np.where(at_low, low, np.where(at_high, high, x + found.x)), low, high)


def refit(
    data: Data,
    model: Model,
    free_parameters: Sequence[FreeParameter],
    rounds: int,
    iterations: int,
    noise_iterations: int,
) -> Fit:
    """Values and noise in turn, until neither gains: a fit with the filter of the noise, then the noise of the fit.

    Costs of different filters are comparable: they include the log determinants of the errors' covariances. Each is
    that of the filter that belongs to the values, and no round ends with a higher cost than the one before: a fit with
    the filter of other values may end where its own filter does worse.

    Args:
        data: recordings.
        model: where the search begins.
        free_parameters: what is free.
        rounds: of both, at most.
        iterations: of each fit, at most.
        noise_iterations: of each fit of the noise, at most.
    """
    best = _by_own_filter(data, descend(data, model, data.filter(model), free_parameters, iterations))
    for number in range(rounds):
        begin, kalman = _likelier_noise(data, best, noise_iterations, afresh=number == 0)
        found = _by_own_filter(data, descend(data, begin, kalman, free_parameters, iterations))
        if found.cost > best.cost:  # the noise alone has made it likelier, if anything has
            found = _by_own_filter(data, best._replace(model=begin))
        gained, best = best.cost - found.cost, min(found, best, key=lambda each: each.cost)
        if gained < _CONVERGED:
            break
    return best


def _by_own_filter(data: Data, fit: Fit) -> Fit:
    """The fit with the filter of its values, and a cost that can be compared with those of other filters."""
    kalman = data.filter(fit.model)
    white = data.white(fit.model, kalman)
    value = _cost(white, fit.free_parameters, fit.values)
    return fit._replace(
        kalman=kalman, white=white, cost=value + _log_determinants(data, kalman) + data.penalty(fit.model)
    )


def _log_determinants(data: Data, kalman: Filter) -> float:
    """Their sum over the instants that count."""
    last = len(kalman.log_determinants) - 1
    rows = [np.minimum(np.flatnonzero(usable[1:]) + 1, last) for usable in data.usable]
    return float(sum(kalman.log_determinants[row].sum() for row in rows))


def _likelier_noise(data: Data, fit: Fit, iterations: int, afresh: bool) -> tuple[Model, Filter]:
    """The model of a fit with other noise, and the filter of it, under which its recordings are likelier.

    The noise is fitted with the linear model. Where the true one slips or knocks, that foretells gains that are none:
    then the levels go only a part of the way, or stay.

    Args:
        data: recordings.
        fit: with a cost that includes the log determinants.
        iterations: of the fit of the noise, at most.
        afresh: as of `noise_fit.fit_noise`.
    """
    old, new = fit.model.noise, data.with_noise(fit.model, iterations, afresh).noise
    for share in _NOISE_STEPS:
        levels = [before ** (1.0 - share) * after**share for before, after in zip(old, new, strict=True)]
        model = fit.model._replace(noise=NoiseModel(*levels))
        kalman = data.filter(model)
        white = data.white(model, kalman)
        value = float(white @ white) + penalty(fit.free_parameters, fit.values) + _log_determinants(data, kalman)
        if value + data.penalty(model) < fit.cost:
            return model, kalman
    return fit.model, fit.kalman
