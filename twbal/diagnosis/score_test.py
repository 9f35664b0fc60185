"""Score test of every candidate: how much likelier would each make the recordings?

The noise and the filter stay those of the model so far; a few steps are fitted from the best of several starts.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.core.threads import in_threads
from twbal.diagnosis.candidates import Candidate, CandidateParameter
from twbal.diagnosis.grid_search import local_optima
from twbal.diagnosis.wave_search import likeliest_wave
from twbal.sysid.model import Data, FreeParameter, Model
from twbal.sysid.normal_equations import inverse_of
from twbal.sysid.prediction_error_fit import Fit, descend, penalty, slopes_of

_SIZES = (0.001, 0.1, 0.4, 1.0, 1.7, 3.0, -0.001, -0.3, -1.0)
"""Sizes at which a candidate is tried, as shares of the way from none to its start value."""
_LIMITS = (
    *(0.98, 0.7, 0.5, 0.35, 0.25, 0.17, 0.1),
    *(0.05, 0.03, 0.015, 0.005, 0.0015, 0.0005, 0.00015),
)
"""Shares of the highest value at which a limit is tried."""
_BETWEEN = 7  # values that are tried between the least limit that changes nothing and the next one
_IDLE = 1e-6  # squared change of the whitened errors below which a value changes nothing
_SMALL = 0.01  # sizes up to this one predict, larger ones are too far off for a parabola
_ITERATIONS = 3
_FITTED, _LEAST = 14, 6.0  # candidates that are fitted by a few steps, and what they must be predicted to gain
_BY_JOINT_GAIN = 6  # others that are fitted so, for their joint gain
_ELSEWHERE = 2  # other local optima of a likelihood, at most
_FREQUENCIES = 9  # frequencies at which a resonance is tried, evenly by ratio


class ScoredCandidate(NamedTuple):
    """A candidate, and how much it may gain.

    Attributes:
        candidate: which.
        gain: in -2 log likelihood, predicted from its slopes, or of a short fit.
        model: with its values.
        detectable: by size, as a share of its start values: gain in -2 log likelihood that the candidate would have
            brought, had it been there at that size.
        joint_gain: predicted to first order if the other free values were fitted with the candidate.
        elsewhere: models at other local optima of the likelihood, from which a fit may begin as well.
    """

    candidate: Candidate
    gain: float
    model: Model
    detectable: Mapping[float, float]
    joint_gain: float = 0.0
    elsewhere: tuple[Model, ...] = ()


def score_candidates(data: Data, fit: Fit, candidates: Sequence[Candidate]) -> list[ScoredCandidate]:
    """What every candidate would gain, the most promising first.

    Those whose slopes predict most are fitted by a few steps, and some others of a large joint gain, which is often
    predicted too large. Of all others no gain is claimed.

    Args:
        data: recordings.
        fit: the model so far; its filter serves all. Nothing is scored where its predictions diverge.
        candidates: which it does not hold yet.
    """
    if not np.isfinite(fit.white).all():
        return []
    J = slopes_of(data, fit)
    predicted = sorted(in_threads(lambda each: _predict(data, fit, J, each), candidates), key=lambda each: -each.gain)
    fitted = [each for each in predicted[:_FITTED] if each.gain > _LEAST]
    others = sorted(predicted[len(fitted) :], key=lambda each: -each.joint_gain)
    fitted += [each for each in others[:_BY_JOINT_GAIN] if each.joint_gain > _LEAST]
    found = in_threads(lambda each: _fit_briefly(data, fit, J, each), fitted)
    names = {each.candidate.name for each in fitted}
    found += [each._replace(gain=min(each.gain, 0.0)) for each in predicted if each.candidate.name not in names]
    return sorted(found, key=lambda each: -each.gain)


def _fit_briefly(data: Data, fit: Fit, J: Array, scored: ScoredCandidate) -> ScoredCandidate:
    """Fit a candidate by a few steps, with the slopes by all else as they are without it."""
    own = scored.candidate.free_parameters
    kept = [i for i, free in enumerate(fit.free_parameters) if free.field not in {o.field for o in own}]
    free_parameters = [fit.free_parameters[i] for i in kept]
    begin = float(fit.white @ fit.white) + penalty(fit.free_parameters, fit.values)
    after = descend(data, scored.model, fit.kalman, [*free_parameters, *own], _ITERATIONS, J[:, kept])
    return scored._replace(gain=begin - after.cost, model=after.model)


def values_of(candidate: Candidate, which: str) -> dict[str, float]:
    """An attribute of a candidate's parameters, by field."""
    return {candidate.field(p): float(getattr(p, which)) for p in candidate.parameters}


def sizes_of(candidate: Candidate) -> tuple[float, ...]:
    """Shares of the way from none to its start at which a candidate is tried; a limit is tried at ever lower values."""
    size = candidate.parameters[0]
    if not size.is_limit:
        return _SIZES
    return tuple((size.none - share * size.high) / (size.none - size.start) for share in _LIMITS)


def _sizes_above(candidate: Candidate, size: float) -> list[float]:
    """Sizes at which a limit is tried between the one that changed something and the one before, evenly by ratio."""
    sizes = sizes_of(candidate)
    before = sizes.index(size) - 1
    if before < 0:
        return []
    limit = candidate.parameters[0]
    high, low = (limit.none + each * (limit.start - limit.none) for each in (sizes[before], size))
    values = np.geomspace(high, low, _BETWEEN + 2)[1:-1]
    return [float(value - limit.none) / (limit.start - limit.none) for value in values]


def _predict(data: Data, fit: Fit, J: Array, candidate: Candidate) -> ScoredCandidate:
    """Try several sizes of a candidate, shares of the way from none to its start.

    What a small size changes in the errors, less what the other free values can make up for, is a slope; along it the
    cost is a parabola, whose lowest point is the predicted gain. So is what a larger size gains as it is. The joint
    gain of a size is to first order, with the other free values where they make up for most of its change.
    """
    usual = values_of(candidate, "start")
    start = usual | likeliest_wave(data, fit, candidate)
    none, low, high = (values_of(candidate, which) for which in ("none", "low", "high"))
    kept = [i for i, free in enumerate(fit.free_parameters) if free.field not in start]
    frozen, free_parameters = J[:, kept], [fit.free_parameters[i] for i in kept]
    ridge = np.array([1.0 / free.sd**2 + 1e-6 / (free.high - free.low) ** 2 for free in free_parameters])
    normal = inverse_of(frozen.T @ frozen + np.diag(ridge))
    own = [free for free in fit.free_parameters if free.field in start]
    freed = penalty(own, np.array([fit.model.value(free.field) for free in own]))  # prior that it does away with
    now = {f: min(max(fit.model.value(f), low[f]), high[f]) for f in start}
    without = data.white(fit.model.put(none), fit.kalman) if own else fit.white
    shift = penalty(fit.free_parameters, fit.values)
    best, gain, joint_gain = np.inf, -np.inf, 0.0
    jointly: Model | None = None
    detectable = dict[float, float]()
    model, elsewhere = fit.model.put(now), tuple[Model, ...]()

    def power_of(change: Array) -> float:
        pull = frozen.T @ change
        return float(change @ change - pull @ normal @ pull)

    start |= _resonance_frequency(data, fit, candidate, start, power_of)
    if candidate.is_wave or candidate.resonance:  # of these, only the size is tried at several values
        none = {f: value if i else none[f] for i, (f, value) in enumerate(start.items())}
    sizes = [*((0.0,) if own else ()), *sizes_of(candidate)]
    is_idle = candidate.parameters[0].is_limit and not own  # nothing that was tried has changed anything
    for size in sizes:
        values = {f: min(max(none[f] + size * (start[f] - none[f]), low[f]), high[f]) for f in start} if size else now
        tried, white = fit.model.put(values), _white(data, fit, values)
        if not np.isfinite(white).all():
            continue
        change = white - fit.white
        power = power_of(change)
        if is_idle and power > _IDLE:
            is_idle = False
            sizes += _sizes_above(candidate, size)
        slope = -float(change @ fit.white)
        small = abs(size) <= _SMALL and not own
        predicted = slope**2 / power if small and slope > 0.0 and power > _IDLE else 0.0
        cost = float(white @ white)
        joint = 2.0 * slope - power
        gain = max(gain, freed + predicted, freed + float(fit.white @ fit.white) - cost)
        if joint > joint_gain:
            joint_gain, jointly = joint, _less(tried, free_parameters, normal @ (frozen.T @ change))
        if size > 0.0 and not candidate.is_wave:  # sizes of a wave are those of the one that was found
            detectable[size] = power if not own else _beyond_prior(power_of(white - without), _prior_of(own, tried))
        if cost < best:
            best, model = cost, tried
    if jointly is not None:
        moved = penalty(fit.free_parameters, np.array([jointly.value(free.field) for free in fit.free_parameters]))
        cost = float(np.nan_to_num(np.sum(data.white(jointly, fit.kalman) ** 2), nan=np.inf))
        model = jointly if cost + moved - shift < best else model
    if candidate.tried_at:
        optima = local_optima(data, fit, candidate)
        gain = max(gain, freed + float(fit.white @ fit.white) - optima[0].cost)
        model = optima[0].model if optima[0].cost < best else model
        elsewhere = tuple(each.model for each in optima if each.model is not model)[:_ELSEWHERE]
    if candidate.is_wave or candidate.parameters[0].is_limit:  # their usual size is none of those that are tried
        change = data.white(fit.model.put(usual), fit.kalman) - fit.white
        detectable[1.0] = power_of(change) if np.isfinite(change).all() else np.inf
    return ScoredCandidate(candidate, gain, model, detectable, freed + joint_gain, elsewhere)


def _white(data: Data, fit: Fit, values: Mapping[str, float]) -> Array:
    """Whitened errors of a fit's model with other values; negative sizes of what cannot be negative are none."""
    if all(fit.model.value(field) == value for field, value in values.items()):
        return fit.white
    return data.white(fit.model.put(values), fit.kalman)


def _beyond_prior(gain: float, prior: float) -> float:
    """Gain of an effect that every model has within a prior, which explains a part of it without the effect.

    Of a parabola of the cost and one of the prior, the lowest sum lies where their slopes cancel.

    Args:
        gain: if nothing else could explain it.
        prior: -2 log of the prior's density at its size, over that at its mean.
    """
    return gain * prior / (gain + prior) if gain + prior > 0.0 else 0.0


def _prior_of(own: Sequence[FreeParameter], model: Model) -> float:
    """-2 log of the prior's density at a model's values, over that at its mean."""
    return penalty(own, np.array([model.value(free.field) for free in own]))


def _less(model: Model, free_parameters: Sequence[FreeParameter], back: Array) -> Model:
    """A model with free values that are less by so much, within their bounds."""
    moved = {
        free.field: float(np.clip(model.value(free.field) - by, free.low, free.high))
        for free, by in zip(free_parameters, back, strict=True)
    }
    return model.put(moved)


def resonance_frequencies(frequency: CandidateParameter) -> list[float]:
    """At which a resonance is tried."""
    return [float(each) for each in np.geomspace(frequency.low, frequency.high, _FREQUENCIES)]


def _resonance_frequency(
    data: Data, fit: Fit, candidate: Candidate, start: Mapping[str, float], power_of: Callable[[Array], float]
) -> dict[str, float]:
    """Frequency at which a resonance is predicted to gain most while it is small; of a resonance only.

    Args:
        data, fit, candidate: as of `_predict`.
        start: values of the candidate.
        power_of: squared length of a change of the errors, less what the other free values can make up for.
    """
    frequency = candidate.resonance
    if frequency is None:
        return {}
    size, field = candidate.parameters[0], candidate.field(frequency)
    small = {candidate.field(size): size.none + _SMALL * (size.start - size.none)}
    best, found = 0.0, frequency.start
    for value in resonance_frequencies(frequency):
        change = data.white(fit.model.put({**start, **small, field: value}), fit.kalman) - fit.white
        if not np.isfinite(change).all():
            continue
        slope, power = -float(change @ fit.white), power_of(change)
        if slope > 0.0 and power > _IDLE and slope**2 / power > best:
            best, found = slope**2 / power, value
    return {field: found}
