"""Where to fit an effect whose likelihood has many peaks, such as a backlash: it is tried at hundreds of places.

The beginnings of the recordings tell which places are worth more. From these on, a simplex search goes uphill with all
that was recorded. It needs no slopes, which say little where impacts come and go. (J. A. Nelder, R. Mead: A simplex
method for function minimization, The Computer Journal 7 (4), 1965, 308-313.)
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from scipy.optimize import minimize

from twbal.core.gaussian import Array
from twbal.diagnosis.candidates import Candidate
from twbal.sysid.model import Data, Field, Model
from twbal.sysid.prediction_error_fit import Fit

_SECONDS = 10.0  # of the recordings' beginnings, in which all places are tried
_IMPROVED, _EVALUATIONS = 4, 60  # places from which simplex searches begin, and models that each of them tries
_SIDE = 0.15  # of the first simplex, over the values
_SETTLED = 0.5  # gain in -2 log likelihood below which a search is done
_DIVERGED = 1e12


def likeliest_of_many(data: Data, fit: Fit, candidate: Candidate) -> tuple[Model, float]:
    """The likeliest model with a candidate that is tried at many places, and its squared errors.

    Args:
        data: recordings.
        fit: the model so far; its filter serves all.
        candidate: with values at which it is tried (`Candidate.tried_at`).
    """
    known = {p.name: p for p in candidate.parameters}
    fields = [candidate.field(known[name]) for name, _ in candidate.tried_at]
    least = np.array([known[name].low for name, _ in candidate.tried_at])
    most = np.array([known[name].high for name, _ in candidate.tried_at])
    none = {candidate.field(p): p.none for p in candidate.parameters}
    part = data.shortened(round(_SECONDS / data.period))
    screened = partial(_squared_errors, part, fit, none, fields)
    places = [np.array(values) for values in product(*(values for _, values in candidate.tried_at))]
    costs = np.array([screened(place) for place in places])
    best = np.argsort(costs, kind="stable")[:_IMPROVED]
    none_at_all = screened(np.array([none[field] for field in fields]))
    worth = [i for i in best if costs[i] < none_at_all] or [best[0]]
    cost = partial(_squared_errors, data, fit, none, fields)
    found = min((_uphill(cost, places[i], least, most) for i in worth), key=lambda each: each[1])
    return fit.model.put({**none, **dict(zip(fields, found[0].tolist(), strict=True))}), found[1]


def _squared_errors(data: Data, fit: Fit, none: Mapping[Field, float], fields: Sequence[Field], values: Array) -> float:
    """Whitened errors, squared and summed, of a model with values in these fields; huge where predictions diverge."""
    tried = fit.model.put({**none, **dict(zip(fields, values.tolist(), strict=True))})
    white = data.white(tried, fit.kalman)
    cost = float(white @ white)
    return cost if np.isfinite(cost) else _DIVERGED


def _uphill(cost: Callable[[Array], float], start: Array, least: Array, most: Array) -> tuple[Array, float]:
    """Values within bounds where a simplex search ends, and their cost."""
    simplex = np.vstack([start, start + _SIDE * np.diag(start)])
    options: dict[str, Any] = {"initial_simplex": simplex, "maxfev": _EVALUATIONS, "xatol": 0.0, "fatol": _SETTLED}
    found = minimize(cost, start, method="Nelder-Mead", bounds=list(zip(least, most, strict=True)), options=options)
    return found.x, float(found.fun)
