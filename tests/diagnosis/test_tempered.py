"""The problem that a tempered search works on, and the search itself."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_settings import SETTINGS
from synthetic_recordings import synthetic_recording

from twbal.diagnosis.candidates import always_free
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.name import QUIETEST, first_noise, largest_noise, with_fitted_noise
from twbal.diagnosis.objections import shifts_of
from twbal.diagnosis.problem import Problem, Selection
from twbal.diagnosis.tempered import settled, tempered_search
from twbal.planar.parameters import planar_parameters
from twbal.sysid.model import Data, Model
from twbal.sysid.prediction_error_fit import descend, penalty

HIDDEN = {"coulomb_friction": {"torque": 0.4}, "actuation_delay": {"delay": 0.012}}


@pytest.fixture(scope="module")
def problem(paper):
    recordings = [synthetic_recording(paper, HIDDEN, seed=s, periods=300) for s in (51, 52)]
    data = Data(recordings, SETTINGS.substeps, largest_noise(paper), QUIETEST)
    planar = planar_parameters(paper, {})
    start = with_fitted_noise(data, Model(planar, 0.0, first_noise(paper, data.sensed)))
    few = [c for c in candidates_for(paper) if c.name in {*HIDDEN, "ground_slope", "motor_lag"}]
    return Problem(data, start, always_free(SETTINGS.tolerances, planar, 2), few, SETTINGS)


@pytest.mark.parametrize("temperature", [1.0, 30.0, 1000.0])
def test_narrower_tolerances_are_a_likelihood_to_a_power(problem, temperature):
    kalman = problem.data.filter(problem.start)
    found = descend(problem.data, problem.start, kalman, problem.tempered(temperature).always, 30)
    names = [free.field for free in problem.always]

    def cost(values):
        white = problem.data.white(problem.start.put(dict(zip(names, values, strict=True))), kalman)
        return float(white @ white) / temperature + penalty(problem.always, np.array(values))

    best = cost(found.values)
    for i, free in enumerate(problem.always):
        for side in (-1, 1):
            aside = found.values.copy()
            aside[i] += side * 0.3 * free.sd
            if free.low <= aside[i] <= free.high:
                assert cost(aside) > best - 0.01


def test_a_higher_temperature_keeps_the_data_sheet_closer(problem):
    kalman = problem.data.filter(problem.start)
    shifts = [
        penalty(problem.always, descend(problem.data, problem.start, kalman, problem.tempered(t).always, 30).values)
        for t in (1.0, 30.0, 1000.0)
    ]
    assert shifts[0] > 2.0 * shifts[1] > 4.0 * shifts[2]


def test_the_shortened_problem_has_the_beginning_of_each_recording(problem):
    part = problem.shortened(200)
    assert 200 <= part.data.count <= 204
    for whole, short in zip(problem.data.recordings, part.data.recordings, strict=True):
        assert len(short) == 100
        assert np.array_equal(short.measured, whole.measured[:101])
        assert np.array_equal(short.commands, whole.commands[:100])
    assert problem.shortened(10**6).data.count == problem.data.count


@pytest.mark.slow
def test_the_search_finds_what_is_hidden(problem):
    said = []
    base = problem.fit(problem.start, (), 3)
    found, rounds = tempered_search(problem, Selection(base, (), base), said.append)
    assert found.names == tuple(sorted(HIDDEN))
    assert found.bic < base.bic - 100.0
    assert rounds[-1].base.names == found.names  # to which nothing was worth adding
    assert found.fit.model.value("coulomb_friction_torque") == pytest.approx(0.4, rel=0.1)
    assert found.fit.model.value("actuation_delay_delay") == pytest.approx(0.012, rel=0.1)
    assert any("likelihood tempered" in line for line in said)


def test_what_a_set_lacks_does_not_move_the_data_sheet_of_a_robot_equal_to_it(paper, problem):
    """Friction without the delay that is there, too."""
    recordings = [synthetic_recording(paper, HIDDEN, seed=s, periods=300, tolerance=0.0) for s in (53, 54)]
    problem = problem._replace(data=replace(problem.data, recordings=recordings))
    (friction,) = (c for c in problem.candidates if c.name == "coulomb_friction")
    chosen = problem.fit_at_once([friction])
    found = settled(problem, chosen)
    assert found.temperature > 2.0
    before, after = (max(abs(shift.sigmas) for shift in shifts_of(w, SETTINGS)) for w in (chosen, found))
    assert before > 3.0 * after
    assert after < 1.5
    assert found.bic == chosen.bic  # it is judged by the likelihood as it is
    assert problem.tempered(found.temperature).always == list(found.fit.free_parameters[: len(problem.always)])
