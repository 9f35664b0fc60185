"""An effect that can be no finding leaves a set where the others explain the data, told by sets set up by hand."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from test_likeliest import BASE, SETTINGS, SIZE

from twbal.diagnosis import likeliest
from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.hypothesis import FittedHypothesis
from twbal.diagnosis.objections import BOUNDLESS, Objection, may_be_a_finding
from twbal.diagnosis.problem import Problem, Selection
from twbal.sysid.model import FreeParameter
from twbal.sysid.prediction_error_fit import Fit

INSIDE, BOUND = 0.5, 0.9999


def hypothesis(sizes, score=500.0, autocorrelation=2.0):
    """A set of effects of these sizes, by name, with this score over the autocorrelation that it leaves."""
    candidates = tuple(Candidate(name, (SIZE,), (), (), "") for name in sizes)
    free = [FreeParameter(c.field(SIZE), 0.0, 1.0, 0.0, np.inf, 1e-4, c.name, "size") for c in candidates]
    values = {each.field: sizes[each.effect] for each in free}
    model = SimpleNamespace(put=lambda values: values, value=values.__getitem__)
    fit = Fit(model, tuple(free), -score * autocorrelation, None, np.zeros(8))
    return FittedHypothesis(candidates, fit, np.full(4, autocorrelation), 0.0)


@pytest.fixture
def ended(monkeypatch):
    """The selection that ends with a set, where what is left of it is fitted as `rest` says."""

    def end(chosen, rest):
        fits = []

        def fit(data, model, always, candidates, rounds):
            fits.append(tuple(candidate.name for candidate in candidates))
            return hypothesis(rest["sizes"], **rest["of"]) if len(fits) == 1 else hypothesis({}, 0.0)

        monkeypatch.setattr("twbal.diagnosis.problem.fit_hypothesis", fit)
        problem = Problem(None, None, (), (), SETTINGS)
        selection = Selection(BASE, (), chosen)
        explains = partial(may_be_a_finding, settings=SETTINGS)
        return likeliest.without_untenable(problem, selection, BOUNDLESS, explains, lambda line: None), fits

    return end


def test_an_effect_at_a_bound_leaves_where_the_rest_explains_the_data(ended):
    chosen = hypothesis({"backlash": INSIDE, "flexible_frame": BOUND})
    selection, fits = ended(chosen, {"sizes": {"backlash": INSIDE}, "of": {"score": 300.0}})
    assert fits[0] == ("backlash",)
    assert selection.chosen.names == ("backlash",)
    assert {w.names for w in selection.sets} >= {chosen.names, ("backlash",)}


@pytest.mark.parametrize(
    "rest",
    [
        {"sizes": {"backlash": INSIDE}, "of": {"autocorrelation": 20.0}},
        {"sizes": {"backlash": BOUND}, "of": {}},
    ],
    ids=["errors stay autocorrelated", "another parameter runs to a bound"],
)
def test_it_stays_where_the_rest_does_not_explain_the_data(ended, rest):
    chosen = hypothesis({"backlash": INSIDE, "flexible_frame": BOUND})
    assert ended(chosen, rest)[0].chosen is chosen


@pytest.mark.parametrize("sizes", [{"backlash": INSIDE, "dead_zone": INSIDE}, {"flexible_frame": BOUND}])
def test_nothing_is_fitted_where_all_is_tenable_or_nothing_would_be_left(ended, sizes):
    chosen = hypothesis(sizes)
    selection, fits = ended(chosen, {"sizes": {}, "of": {}})
    assert selection.chosen is chosen and not fits


def test_a_wave_that_is_too_slow_leaves_too(ended, monkeypatch):
    slow = Objection("too slow", ("ground_waves",))
    monkeypatch.setattr(likeliest, "to_slow_waves", lambda hypothesis, extent: [slow])
    chosen = hypothesis({"backlash": INSIDE, "ground_waves": INSIDE})
    assert ended(chosen, {"sizes": {"backlash": INSIDE}, "of": {}})[0].chosen.names == ("backlash",)
