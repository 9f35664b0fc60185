from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_t
from synthetic_recordings import synthetic_recording

from twbal.diagnosis.candidates import always_free
from twbal.diagnosis.settings import Tolerances
from twbal.planar.parameters import planar_parameters
from twbal.sysid.intervals import standard_errors
from twbal.sysid.model import ANGLE_LEAD, Data, FreeParameter, LogOffset, Model, Offsets
from twbal.sysid.noise import NoiseModel
from twbal.sysid.prediction_error_fit import descend, penalty, refit, slopes, slopes_of

NOISE = NoiseModel(np.array([0.004, 0.02, 0.002, 0.05]), np.array([0.01, 0.01]))
TRUTH = {"coulomb_friction": {"torque": 0.1}, "actuation_delay": {"delay": 0.008}}
TAIL = 10.0  # degrees of freedom of the errors' distribution
FREES = (
    FreeParameter("torque_gain_gain", 0.4, 2.5, 1.0, 0.03, 1e-5),
    FreeParameter("body_mass_factor", 0.4, 2.5, 1.0, 0.03, 1e-5),
    FreeParameter("coulomb_friction_torque", 0.0, 1.0, 0.0, np.inf, 1e-5),
    FreeParameter("actuation_delay_delay", 0.0, 0.05, 0.0, np.inf, 1e-6),
    FreeParameter(ANGLE_LEAD, -0.005, 0.005, 0.0, 0.00025, 1e-7),
)


@pytest.fixture(scope="module")
def data(paper):
    return Data([synthetic_recording(paper, TRUTH, seed=1, periods=700, tolerance=0.0)], 10)


@pytest.fixture(scope="module")
def start(paper):
    planar = planar_parameters(paper, {"coulomb_friction": {"torque": 0.05}, "actuation_delay": {"delay": 0.004}})
    return Model(planar, 0.0, NOISE)


def test_slopes_are_the_derivatives_of_the_errors(data, start):
    kalman = data.filter(start)
    white = data.white(start, kalman)
    J = slopes(data, start, kalman, FREES, white)
    for i, free in enumerate(FREES):
        e = 20 * free.nudge
        value = start.value(free.field)
        up, down = (data.white(start.put({free.field: value + s * e}), kalman) for s in (1, -1))
        scale = np.linalg.norm(J[:, i])
        assert np.linalg.norm(J[:, i] - (up - down) / (2 * e)) < 0.05 * scale


@pytest.mark.parametrize("balanced", [0, 2, 3])
def test_slopes_by_offsets_are_those_of_one_recording_each(balanced, data, start):
    """They are found together; here each by itself."""
    three = replace(data, recordings=[data.recordings[0].part(0, end) for end in (90, 150, 120)])
    model = start._replace(offsets=(Offsets(0.01), Offsets(torque=0.05), Offsets(slope=-0.01)), balanced=balanced)
    fields = [LogOffset(number, kind) for kind in Offsets._fields for number in range(3)]
    free_parameters = [FreeParameter(field, -1.0, 1.0, 0.0, 0.05, 1e-6) for field in fields]
    kalman = three.filter(model)
    white = three.white(model, kalman)
    J = slopes(three, model, kalman, [FREES[0], *free_parameters], white)
    for column, free in zip(J.T[1:], free_parameters, strict=True):
        moved = three.white(model.put({free.field: model.value(free.field) + free.nudge}), kalman)
        assert np.linalg.norm(column - (moved - white) / free.nudge) < 1e-4 * np.linalg.norm(column)
        assert np.linalg.norm(column) > 1.0


def test_a_fit_knows_the_filter_of_its_errors(data, start):
    """Slopes are differences of errors: with another filter than that of the fit they would be all filter."""
    fit = refit(data, start, FREES, 2, 2, 12)
    np.testing.assert_array_equal(data.white(fit.model, fit.kalman), fit.white)
    J = slopes_of(data, fit)
    for i, free in enumerate(FREES):
        e = 20 * free.nudge
        up, down = (data.white(fit.model.put({free.field: fit.values[i] + s * e}), fit.kalman) for s in (1, -1))
        assert np.linalg.norm(J[:, i] - (up - down) / (2 * e)) < 0.05 * np.linalg.norm(J[:, i])


def test_a_fit_ends_where_the_cost_is_flat(data, start):
    fit = descend(data, start, data.filter(start), FREES, 30)
    J = slopes_of(data, fit)
    sds = np.array([free.sd for free in FREES])
    pull = J.T @ fit.white + (fit.values - [free.mean for free in FREES]) / sds**2
    assert np.abs(pull / np.linalg.norm(J, axis=0)).max() < 0.5
    assert fit.cost == pytest.approx(fit.white @ fit.white + penalty(FREES, fit.values))


def test_slopes_that_are_kept_change_the_way_but_not_the_end(data, start):
    """With the slopes by the data sheet's values as they were at the start, a fit comes nearly as far."""
    kalman = data.filter(start)
    J = slopes(data, start, kalman, FREES, data.white(start, kalman))
    free = descend(data, start, kalman, FREES, 30)
    kept = descend(data, start, kalman, FREES, 30, known=J[:, :2])
    begin = float(np.sum(data.white(start, kalman) ** 2))
    assert kept.cost - free.cost < 0.01 * (begin - free.cost)


def test_values_stop_at_their_bounds_and_the_others_make_up(data, start):
    tight = (*FREES[:3], FREES[3]._replace(high=0.006), FREES[4])
    fit = descend(data, start, data.filter(start), tight, 20)
    assert fit.values[3] == 0.006


SLIPS = {"wheel_slip": {"friction": 0.08}}


def exact_cost(data, fit):
    """-2 log likelihood by scipy's density, and -2 log prior but for a constant."""
    errors = data.errors(fit.model, fit.kalman)[0]
    total = penalty(fit.free_parameters, fit.values)
    for n in range(1, len(errors)):
        W = fit.kalman.whiteners[min(n, len(fit.kalman.whiteners) - 1)]
        scale = np.linalg.inv(W.T @ W) * (TAIL - 2) / TAIL
        total -= 2.0 * multivariate_t.logpdf(errors[n], shape=scale, df=TAIL)
    return total


@pytest.mark.parametrize(
    ("effects", "seed"),
    [(SLIPS, 1), (SLIPS, 2), ({"wheel_slip": {"friction": 0.16}}, 3), ({"backlash": {"gap": 0.03}}, 1), (TRUTH, 1)],
    ids=str,
)
def test_more_rounds_never_end_worse(paper, effects, seed):
    """On tyres that slip the linear model foretells gains of other noise that the recordings do not bear out."""
    data = Data([synthetic_recording(paper, effects, seed=seed, periods=500)], 10)
    planar = planar_parameters(paper, {})
    begin = data.with_noise(Model(planar, 0.0, NOISE), 30)
    free_parameters = always_free(Tolerances(0.03, 0.15, 0.0003, 0.00025, 0.0, 0.0, 0.0, 0.15), planar, 1)
    costs = [refit(data, begin, free_parameters, rounds, 4, 12).cost for rounds in range(5)]
    assert (np.diff(costs) <= 1e-6).all(), costs


def test_costs_of_different_filters_are_differences_of_log_likelihood(data, start):
    """With scipy's density of Student's t as the truth."""
    few, many = (refit(data, start, FREES, rounds, 2, 12) for rounds in (0, 3))
    assert not np.allclose(few.kalman.gains, many.kalman.gains, rtol=0.01)
    exact = exact_cost(data, many) - exact_cost(data, few)
    assert many.cost - few.cost == pytest.approx(exact, rel=1e-6)


def test_refitting_finds_the_truth_within_its_errors(data, start):
    fit = refit(data, start, FREES, 5, 6, 12)
    errors = standard_errors(fit, slopes_of(data, fit), 14)
    truth = [TRUTH["coulomb_friction"]["torque"], TRUTH["actuation_delay"]["delay"]]
    assert (np.abs(fit.values[2:4] - truth) < 3.5 * errors[2:4]).all()
    np.testing.assert_allclose(fit.values[2:4], truth, rtol=0.05)


def test_intervals_know_that_a_power_likelihood_narrows_priors_only_for_the_fit(data, start):
    fit, temperature = refit(data, start, FREES, 1, 2, 12), 9.0
    narrower = fit._replace(free_parameters=tuple(free._replace(sd=free.sd / 3.0) for free in fit.free_parameters))
    J = slopes_of(data, fit)
    np.testing.assert_allclose(standard_errors(narrower, J, 14, temperature), standard_errors(fit, J, 14), rtol=1e-9)


def test_a_fit_whose_predictions_diverge_has_an_infinite_cost(data, start):
    """Joints so stiff that the planar model's steps do not integrate them."""
    stiff = start.put({"viscous_friction_coefficient": 1e4})
    found = descend(data, stiff, data.filter(start), FREES, 3)
    assert not np.isfinite(data.white(stiff, data.filter(start))).all()
    assert found.cost == np.inf
    assert found.values == pytest.approx([stiff.value(free.field) for free in FREES])


@pytest.mark.parametrize("sides", [(1.0,), (-1.0, 1.0)])
def test_a_fit_goes_on_where_predictions_diverge_a_nudge_further(sides, data, start, monkeypatch):
    """The slope is that of the side on which they do not; of a value that has no such side there is none."""
    edge = start.value("torque_gain_gain")
    white = Data.white

    def diverges(self, model, kalman):
        found = white(self, model, kalman)
        return found * (np.nan if np.sign(model.value("torque_gain_gain") - edge) in sides else 1.0)

    monkeypatch.setattr(Data, "white", diverges)
    before = descend(data, start, data.filter(start), FREES, 0)
    found = descend(data, start, data.filter(start), FREES, 3)
    assert found.cost < before.cost < np.inf
    assert np.sign(found.model.value("torque_gain_gain") - edge) not in sides


def test_where_predictions_diverge_a_fit_ends_and_no_slope_is_a_number(data, start):
    kalman = data.filter(start)._replace(gains=-10.0 * data.filter(start).gains)
    assert descend(data, start, kalman, FREES, 3).cost == np.inf
    assert np.isnan(slopes(data, start, kalman, FREES, data.white(start, kalman))).all()
