"""Where to fit an effect whose likelihood has many local optima, such as a backlash: by a grid, then simplex searches.

The beginnings of the recordings tell which points of the grid are worth more. From these on, a simplex search lowers
the cost with all that was recorded. It needs no slopes, which say little where impacts come and go. (J. A. Nelder, R.
Mead: A simplex method for function minimization, The Computer Journal 7 (4), 1965, 308-313.)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize

from twbal.core.gaussian import Array
from twbal.diagnosis.candidates import Candidate, CandidateParameter
from twbal.sysid.kalman import Filter
from twbal.sysid.model import Data, Field, FreeParameter, Model
from twbal.sysid.prediction_error_fit import Fit, penalty

_SECONDS = 5.0  # of the recordings' beginnings, on which the whole grid is tried
_SEARCHES = 4  # simplex searches
_EVALUATIONS, _MOST = 15, 90  # models that each of them tries for each of its parameters, and at most
_FIRST, _LATER = 0.15, 0.05  # side of the first simplex, over the values: of a grid's point, and of fitted values
_LEAST = 0.3  # of the usual size of a parameter, for which the first simplex is at least as wide as that
_PROMISING = 3.0  # gain in -2 log likelihood on the beginnings from which on a point is searched from
_WORTH = 20.0  # the same on all recordings, from which on an effect may be there
_SETTLED = 0.5  # the same below which a search is done
_APART = 0.1  # share of its size by which an effect differs between two local optima
_DIVERGED = 1e12


class LocalOptimum(NamedTuple):
    """Where a search ended.

    Attributes:
        model: with the candidate.
        cost: its whitened errors, squared and summed.
    """

    model: Model
    cost: float


def local_optima(data: Data, fit: Fit, candidate: Candidate) -> list[LocalOptimum]:
    """Models with a candidate that is tried on a grid, the likeliest first.

    Without an effect, a fit pulls the data sheet to where it makes up for some of it, and the effect's own optimum is
    not found from there. So where the candidate gains, the likeliest of a data sheet that is as it was comes second.

    Args:
        data: recordings.
        fit: the model so far; its filter serves all.
        candidate: with a grid (`Candidate.tried_at`).
    """
    found = _optima(data, fit.model, fit.kalman, candidate)
    if found[0].cost > float(fit.white @ fit.white) - _WORTH:
        return found
    means = {free.field: free.mean for free in fit.free_parameters if np.isfinite(free.sd)}
    return [found[0], _optima(data, fit.model.put(means), fit.kalman, candidate)[0], *found[1:]]


def _optima(data: Data, model: Model, kalman: Filter, candidate: Candidate) -> list[LocalOptimum]:
    """Where simplex searches end from the promising points of the grid, the likeliest first; or its best point."""
    begin, searched = model.put({candidate.field(p): p.none for p in candidate.parameters}), _searched(candidate)
    points = [np.array(values) for values in product(*(values for _, values in candidate.tried_at))]
    part = _Search(data.shortened(round(_SECONDS / data.period)), begin, kalman, (), searched)
    costs = np.array([part.cost(point) for point in points])
    best = np.argsort(costs, kind="stable")[:_SEARCHES]
    least = part.cost(np.array([p.none for _, p in searched])) - _PROMISING
    search = _Search(data, begin, kalman, (), searched)
    found = [search.downhill(points[i], _FIRST) for i in best if costs[i] < least] or [search.at(points[best[0]])]
    size = candidate.field(candidate.parameters[0])
    apart = list[LocalOptimum]()
    for optimum in sorted(found, key=lambda each: each.cost):
        here = optimum.model.value(size)
        if all(abs(here - other.model.value(size)) > _APART * abs(here) for other in apart):
            apart.append(optimum)
    return apart


def improved(data: Data, fit: Fit, candidates: Sequence[Candidate]) -> Model | None:
    """A likelier model than that of a fit, by the parameters of its effects; None where none is near.

    Args:
        data: recordings.
        fit: in which these parameters are free.
        candidates: the effects.
    """
    parameters = [(candidate.field(p), p) for candidate in candidates for p in candidate.parameters]
    search = _Search(data, fit.model, data.filter(fit.model), fit.free_parameters, parameters)
    start = np.array([fit.model.value(field) for field, _ in parameters])
    found = search.downhill(start, _LATER)
    return found.model if found.cost < search.cost(start) - _SETTLED else None


def _searched(candidate: Candidate) -> list[tuple[Field, CandidateParameter]]:
    """The parameters of the grid, in its order, with their fields."""
    known = {p.name: p for p in candidate.parameters}
    return [(candidate.field(known[name]), known[name]) for name, _ in candidate.tried_at]


@dataclass(frozen=True)
class _Search:
    """How likely a model is, by the values of some parameters.

    Attributes:
        data: recordings.
        model: all other values.
        kalman: filter that serves all.
        free_parameters: whose priors count.
        parameters: that are searched, with their fields.
    """

    data: Data
    model: Model
    kalman: Filter
    free_parameters: Sequence[FreeParameter]
    parameters: Sequence[tuple[Field, CandidateParameter]]

    def cost(self, values: Array) -> float:
        """Whitened errors, squared and summed, and the prior's cost; huge where predictions diverge."""
        tried = self._with(values)
        white = self.data.white(tried, self.kalman)
        prior = penalty(self.free_parameters, np.array([tried.value(free.field) for free in self.free_parameters]))
        found = float(white @ white) + prior
        return found if np.isfinite(found) else _DIVERGED

    def at(self, values: Array) -> LocalOptimum:
        """The model with some values."""
        return LocalOptimum(self._with(values), self.cost(values))

    def downhill(self, start: Array, side: float) -> LocalOptimum:
        """Where a simplex search ends that begins at some values, with a simplex as wide as a share of them."""
        usual = np.array([abs(p.start - p.none) for _, p in self.parameters])
        simplex = np.vstack([start, start + np.diag(side * np.maximum(np.abs(start), _LEAST * usual))])
        bounds = [(p.low, p.high) for _, p in self.parameters]
        most = min(_EVALUATIONS * len(start), _MOST)
        options: dict[str, Any] = {"initial_simplex": simplex, "maxfev": most, "xatol": 0.0, "fatol": _SETTLED}
        found = minimize(self.cost, start, method="Nelder-Mead", bounds=bounds, options=options)
        return LocalOptimum(self._with(found.x), float(found.fun))

    def _with(self, values: Array) -> Model:
        fields = [field for field, _ in self.parameters]
        return self.model.put(dict(zip(fields, values.tolist(), strict=True)))
