"""Where fits of a filter of the tilt begin: one optimum of the likelihood hides another one."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_settings import SETTINGS
from synthetic_recordings import synthetic_recording

from twbal.diagnosis.candidates import always_free
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.filter_starts import filter_starts, has_lasting_tilt_error
from twbal.diagnosis.hypothesis import Round, add_one, fit_from_all, fit_hypothesis
from twbal.diagnosis.name import first_noise
from twbal.diagnosis.problem import Problem
from twbal.diagnosis.settings import Tolerances
from twbal.planar.parameters import planar_parameters
from twbal.sysid.model import Data, Model
from twbal.sysid.noise import LASTING

TOLERANCES = Tolerances(0.03, 0.15, 0.0003, 0.00025, 0.0, 0.0, 0.0, 0.15)
RATE = 3.0


@pytest.fixture(scope="module")
def known(paper):
    return {candidate.name: candidate for candidate in candidates_for(paper)}


def begun_with(paper, **others):
    """A recording whose tilt comes from a quick filter, and a model that takes what is wrong with it for its own."""
    effects = {"tilt_filter": {"rate": RATE, "lead": 0.006}, **others}
    data = Data([synthetic_recording(paper, effects, seed=3, periods=900, tolerance=0.0)], 10)
    noise = first_noise(paper, np.ones(4, bool))
    discrepancy = np.array([1e-6, 1e-6, 0.006, 1e-6, 1e-6, 1e-6])
    return data, Model(planar_parameters(paper, {}), 0.0, noise._replace(discrepancy=discrepancy))


@pytest.fixture(scope="module")
def begun(paper):
    return begun_with(paper)


@pytest.fixture(scope="module")
def rubbing(paper):
    """With friction that hides the filter: other effects promise more."""
    return begun_with(paper, viscous_friction={"coefficient": 0.3})


def test_a_set_without_a_filter_begins_where_it_did(begun, known):
    data, model = begun
    assert filter_starts(model, [known["com_offset"]], data.period) == []


def test_a_filter_begins_at_several_rates_and_with_little_else_that_lasts(begun, known):
    data, model = begun
    starts = filter_starts(model, [known["com_offset"], known["tilt_filter"]], data.period)
    assert [start.planar.tilt_filter_rate for start in starts] == [1.0, 4.0]
    assert {start.planar.tilt_filter_lead for start in starts} == {0.5 * data.period}
    assert all(start.noise.discrepancy[2] < 0.2 * model.noise.discrepancy[2] for start in starts)
    assert not has_lasting_tilt_error(model._replace(noise=model.noise._replace(discrepancy=np.zeros(LASTING))))


def test_the_filter_is_found_where_an_error_of_the_tilt_hides_it(begun, known, paper):
    data, model = begun
    assert has_lasting_tilt_error(model)
    always = always_free(TOLERANCES, model.planar, 1)
    candidate = known["tilt_filter"]
    slow = model.put({"tilt_filter_rate": 0.02, "tilt_filter_lead": 0.0})
    several = fit_from_all(data, slow, always, [candidate], 6, [candidate])
    assert several.bic <= fit_hypothesis(data, slow, always, [candidate], 6).bic
    assert several.fit.model.planar.tilt_filter_rate == pytest.approx(RATE, rel=0.1)
    assert several.fit.model.planar.tilt_filter_lead == pytest.approx(0.006, abs=0.003)


def test_it_is_fitted_beside_others_that_promise_more(rubbing, known):
    data, model = rubbing
    base = fit_hypothesis(data, model, always_free(TOLERANCES, model.planar, 1), (), 0)
    step = add_one(data, base, always_free(TOLERANCES, model.planar, 1), [*known.values()], shortlist=1, rounds=1)
    assert step.scored[0].candidate.name != "tilt_filter"
    assert "tilt_filter" in {name for fitted in step.hypotheses for name in fitted.names}


@pytest.mark.parametrize(("is_useless", "is_fitted"), [(True, False), (False, True)])
def test_a_filter_that_was_useless_beside_a_part_of_a_set_is_not_fitted_whatever_it_promises(
    rubbing, known, is_useless, is_fitted
):
    """But by itself, where nothing else is worth adding."""
    data, model = rubbing
    always = always_free(TOLERANCES, model.planar, 1)
    hasty = replace(SETTINGS, shortlist=1)
    problem = Problem(data, model, always, [*known.values()], hasty, rounds=1)
    base = problem.fit(model, (), 0)
    tried = problem.fit(model.put({"tilt_filter_rate": RATE}), [known["tilt_filter"]], 0)
    tried = tried._replace(bic_penalty=1e9 if is_useless else -1e9)
    step = problem.add_to(base, [Round(base, [], [tried])])
    assert any("tilt_filter" in w.names for w in step.hypotheses) is is_fitted
    unfitted = Round(base, step.scored, [])
    late = problem.add_filter(unfitted)
    assert late.hypotheses[0].names == ("tilt_filter",)
    assert late.hypotheses[0].bic < base.bic
    assert problem.add_filter(late) is None
