"""A smooth function of one variable, on top of the best set of effects: what the library lacks is drawn, not named.

Each candidate (`free_form_candidates`) is a Gaussian process in weight space (`sysid.smooth_function`), whose weights
bear linearly on the prediction errors; free values of the set and constants are taken out (`sysid.smooth_regression`).
Whether there is a function at all is asked with the noise as it was fitted without one. Then values and noise are
fitted again beside the best function, and the candidates are compared anew: with noise that has to stand for what is
missing, functions are hard to tell apart. The best one is then fitted in place of all effects of the set, in place of
those that are functions of the same variable, and on top of all. The fewest effects that keep most of the likelihood
stay: a set may hold effects that only mimic what is missing, and beside these the difference would be drawn.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.diagnosis.free_form_candidates import CANDIDATES, TILT, FreeFormCandidate
from twbal.diagnosis.free_form_curve import Fitted, drawn, held_out_share
from twbal.diagnosis.free_form_record import FreeForm
from twbal.diagnosis.hypothesis import FittedHypothesis
from twbal.diagnosis.linear_errors import LinearErrors, linear_errors
from twbal.sysid.kalman import Filter
from twbal.sysid.likelihood import cost, weights_of
from twbal.sysid.model import Data, FreeParameter, Model, Offsets
from twbal.sysid.smooth_regression import PriorFit, evidence, null_gains

_SURE = 0.05  # p-value above which nothing is drawn
_LEAST = 10.0  # gain in log evidence below which nothing is drawn [nats]
_NOISE_ITERATIONS = 12
_ROUNDS = 2  # of noise and functions in turn
_SETTLING = 2  # of dispersion and functions in turn
_NEAR = 5  # candidates that are compared again with other noise
_KEPT = 0.7  # share of the gain in likelihood that a function must keep in place of effects
_ALIKE = 0.9  # share of the best gain in evidence from which on another candidate does about as well


class FreeFormInputs(NamedTuple):
    """What free forms are looked for in.

    Attributes:
        data: recordings.
        chosen: the best set of effects, fitted to them.
        always: what is free in a set without effects, with its priors.
        kept_back: recordings that nothing was fitted to.
        offsets: what is free of them there, or their values; see `with_offsets`.
        form: relative standard deviation of a function's size, by what its form and the scale of all torques are off.
    """

    data: Data
    chosen: FittedHypothesis
    always: Sequence[FreeParameter]
    kept_back: Data
    offsets: tuple[Offsets, ...] | Sequence[FreeParameter]
    form: float


def free_forms(inputs: FreeFormInputs) -> tuple[FreeForm, ...]:
    """The function of one variable that explains most of what a set of effects does not; none where none is sure.

    It is none, too, where predictions on held-out data get worse with it.
    """
    data, chosen = inputs.data, inputs.chosen
    whole, model = _Whole(data, chosen, inputs.always), chosen.fit.model
    kalman = data.filter(model)
    errors = data.errors(model, kalman)
    asked = [each for each in CANDIDATES if each.quantity != TILT or data.sensed[0]]
    tried, dispersion = _ranked(whole.without((), model, weights_of(errors, data.usable, kalman)), asked)
    gain, p_value = tried[0].evidence.gain, _p_value(tried[0], dispersion)
    if gain < _LEAST or p_value > _SURE:
        return ()
    for _ in range(_ROUNDS):
        model, weights = _moved_on(tried[0], dispersion)
        tried, dispersion = _ranked(whole.without((), model, weights), [each.candidate for each in tried[:_NEAR]])
    best, *others = tried
    ways = [_refined(whole, best.candidate, names, model, weights) for names in whole.ways(best.candidate)]
    before = cost(errors, data.usable, kalman) + data.penalty(chosen.fit.model)
    enough = before + _KEPT * (min(way.cost for way in ways) - before)
    way = next((each for each in ways if each.cost <= enough), ways[-1])
    share = held_out_share(way.fitted, chosen.fit.model, inputs.kept_back, inputs.offsets, way.dispersion)
    if not share > 0.0:  # none, too, where predictions diverge
        return ()
    curve = drawn(way.fitted, way.dispersion, inputs.form)
    alike = [each.candidate.text for each in others if each.evidence.gain >= _ALIKE * best.evidence.gain]
    return (
        FreeForm(
            quantity=best.candidate.quantity,
            unit=best.candidate.quantity_unit,
            variable=best.candidate.variable,
            variable_unit=best.candidate.unit,
            gain=gain,
            p_value=p_value,
            share=share,
            in_place_of=way.in_place_of,
            alike=tuple(alike),
            shape=curve.shape,
            grid=tuple(curve.grid.tolist()),
            mean=tuple(curve.mean.tolist()),
            low95=tuple(curve.low95.tolist()),
            high95=tuple(curve.high95.tolist()),
        ),
    )


class _Whole(NamedTuple):
    """What free forms are added to.

    Attributes:
        data: recordings.
        chosen: the best set of effects, fitted to them.
        always: what is free in a set without effects, with its priors.
    """

    data: Data
    chosen: FittedHypothesis
    always: Sequence[FreeParameter]

    def without(self, names: Sequence[str], model: Model, weights: list[Array]) -> LinearErrors:
        """The errors of the set without some of its effects, with the noise of a model."""
        gone = [candidate for candidate in self.chosen.candidates if candidate.name in names]
        none = {field: value for candidate in gone for field, value in candidate.none.items()}
        kept = [free for free in self.chosen.fit.free_parameters if free.field not in none]
        kept += [free for free in self.always if free.field in none]
        return linear_errors(self.data, model.put(none), kept, self.data.filter(model), weights)

    def ways(self, candidate: FreeFormCandidate) -> list[tuple[str, ...]]:
        """Effects of the set in whose place a function may come: most first, none last."""
        names = self.chosen.names
        same = tuple(name for name in names if name in candidate.replaces)
        return sorted({names, same, ()}, key=lambda each: -len(each))


class _Refined(NamedTuple):
    """A candidate in place of some effects, with the noise fitted beside it.

    Attributes:
        fitted: the candidate.
        in_place_of: names of the effects.
        dispersion: that it leaves.
        cost: -2 log likelihood, and log prior of the noise, but for a constant.
    """

    fitted: Fitted
    in_place_of: tuple[str, ...]
    dispersion: float
    cost: float


def _refined(
    whole: _Whole, candidate: FreeFormCandidate, names: tuple[str, ...], model: Model, weights: list[Array]
) -> _Refined:
    """Fit noise and function in turn."""
    for _ in range(_ROUNDS + 1):
        (fitted,), dispersion = _ranked(whole.without(names, model, weights), [candidate])
        model, weights = _moved_on(fitted, dispersion)
    (fitted,), dispersion = _ranked(whole.without(names, model, weights), [candidate])
    data = whole.data
    value = cost(fitted.corrected(dispersion), data.usable, fitted.at.kalman) + data.penalty(model)
    return _Refined(fitted, names, dispersion, value)


def _moved_on(fitted: Fitted, dispersion: float) -> tuple[Model, list[Array]]:
    """The model beside a function, with its noise fitted to what that leaves, and weights of instants by that."""
    at, corrected = fitted.at, fitted.corrected(dispersion)
    model = at.moved(fitted.moved(fitted.weights(dispersion).mean))
    found = at.data.with_noise(model, _NOISE_ITERATIONS, errors=corrected)
    return found, weights_of(corrected, at.data.usable, at.kalman)


def _ranked(at: LinearErrors, candidates: Sequence[FreeFormCandidate]) -> tuple[list[Fitted], float]:
    """Candidates by their evidence, the best first, at the dispersion that the best one leaves."""
    found, dispersion = [_tried(candidate, at) for candidate in candidates], 1.0
    for _ in range(_SETTLING):
        found = sorted((_judged(each, dispersion) for each in found), key=lambda each: -each.evidence.gain)
        dispersion = _dispersion(at.data, at.kalman, found[0].corrected(dispersion))
    return [_judged(each, dispersion) for each in found], dispersion


def _judged(fitted: Fitted, dispersion: float) -> Fitted:
    return fitted._replace(evidence=evidence(fitted.found, fitted.functions.spectra, dispersion))


def _tried(candidate: FreeFormCandidate, at: LinearErrors) -> Fitted:
    functions = at.functions(candidate)
    left = at.left_by(candidate, functions)
    return Fitted(candidate, at, functions, left, at.against(left), PriorFit(0.0, np.zeros(0)))


def _p_value(best: Fitted, dispersion: float) -> float:
    """Probability that the best of all candidates gains as much without a function."""
    drawn = null_gains(best.found, best.functions.spectra, dispersion, np.random.default_rng(0))
    return min(len(CANDIDATES) * float(1 + np.sum(drawn >= best.evidence.gain)) / (1.0 + len(drawn)), 1.0)


def _dispersion(data: Data, kalman: Filter, errors: Sequence[Array]) -> float:
    """Residual autocorrelation, at least 1, as of `FittedHypothesis.autocorrelation`."""
    return max(float(np.mean(data.autocorrelation(errors, kalman)[data.sensed])), 1.0)
