from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_are
from scipy.stats import multivariate_t
from synthetic_recordings import NOISE, synthetic_recording

from twbal.effects.library import library
from twbal.effects.parameter import parameters_of
from twbal.planar.linearised import linearise
from twbal.planar.parameters import planar_parameters
from twbal.sysid.kalman import kalman_filter, linearise_period
from twbal.sysid.likelihood import cost, whiten, whitened
from twbal.sysid.linear_response import match_each, respond_each
from twbal.sysid.model import Data, Model
from twbal.sysid.noise import UNSENSED, NoiseModel
from twbal.sysid.noise_fit import fit_noise, refilter

LEVELS = NoiseModel(np.array([0.004, 0.02, 0.002, 0.05]), np.array([0.05, 0.08]))


@pytest.fixture(scope="module")
def recording(paper):
    return synthetic_recording(paper, {}, seed=3, periods=600, tolerance=0.0)


def test_the_linear_model_is_the_exponential_of_the_linearised_equations(paper):
    F = linearise_period(planar_parameters(paper, {}), paper.control_period).F
    A = linearise(paper).A
    exact = expm(A * paper.control_period)  # of tilt, tilt rate and speed
    np.testing.assert_allclose(F[np.ix_([0, 2], [0, 2])], exact[:2, :2], atol=0.02)
    assert F[3, 0] * paper.wheel_radius == pytest.approx(exact[2, 0], rel=0.05)
    np.testing.assert_array_equal(F[4:6, :4], [[1, 0, 0, 0], [0, 0, 1, 0]])


def test_the_gain_settles_at_the_riccati_equations(paper):
    linear = linearise_period(planar_parameters(paper, {}), paper.control_period)
    F, C, Q = linear.F[:4, :4], linear.C[:, :4], (linear.B * LEVELS.torques**2) @ linear.B.T
    R = np.diag(LEVELS.sensors**2)
    P = solve_discrete_are(F.T, C.T, Q[:4, :4] + 1e-14 * np.eye(4), R)
    S = C @ P @ C.T + R
    found = kalman_filter(linear, LEVELS)
    np.testing.assert_allclose(found.gains[-1][:4], P @ C.T @ np.linalg.inv(S), atol=3e-3)
    np.testing.assert_allclose(np.linalg.inv(found.whiteners[-1].T @ found.whiteners[-1]), S, rtol=1e-2, atol=1e-7)


def test_errors_by_another_gain_are_those_of_the_predictor_run_anew(paper, recording):
    data = Data([recording], 10)
    model = Model(planar_parameters(paper, {}), 0.0, LEVELS)
    other = model._replace(noise=NoiseModel(2 * LEVELS.sensors, 0.3 * LEVELS.torques))
    before, after = data.filter(model), data.filter(other)
    linear = linearise_period(model.planar, data.period)
    errors = data.errors(model, before)[0]
    moved = refilter(linear.F, linear.C, before.gains, after.gains, errors)
    truth = data.errors(other, after)[0]
    assert np.abs(moved - truth).max() < 0.02 * np.abs(truth - errors).max()


def test_the_noise_of_the_sensors_is_found(paper, recording):
    data = Data([recording], 10)
    model = Model(planar_parameters(paper, {}), 0.0, LEVELS)
    for _ in range(3):
        model = data.with_noise(model, 30)
    np.testing.assert_allclose(model.noise.sensors, list(NOISE.values()), rtol=0.12)
    assert (model.noise.torques < 0.01).all()


def test_noise_is_no_louder_than_it_may_be_and_else_as_without_a_bound(paper):
    """A force of 6 N, of which the model does not know, and a tilt of 0.004 rad of noise that may have 0.002."""
    effects = {"periodic_disturbance": {"force": 6.0, "frequency": 1.0, "phase": 0.0}}
    shaken = synthetic_recording(paper, effects, seed=3, periods=600, tolerance=0.0)
    model = Model(planar_parameters(paper, {}), 0.0, LEVELS)
    free = Data([shaken], 10).with_noise(model, 30).noise
    loudest = NoiseModel(np.array([0.5 * free.sensors[0], 1.0, 1.0, 1.0]), np.array([np.inf, 0.5 * free.torques[1]]))
    bounded = Data([shaken], 10, loudest).with_noise(model, 30).noise
    for found, most in zip(bounded, loudest, strict=True):
        assert (found <= most * (1 + 1e-9)).all()
    assert bounded.torques[1] == pytest.approx(loudest.torques[1])
    assert bounded.sensors[0] == pytest.approx(loudest.sensors[0])
    wide = Data([shaken], 10, NoiseModel(np.full(4, 9.0), np.full(2, 99.0))).with_noise(model, 30).noise
    np.testing.assert_allclose(np.concatenate(wide), np.concatenate(free), rtol=1e-9)


def test_a_few_wild_samples_leave_the_noise_as_it_is(paper, recording):
    data = Data([recording], 10)
    model = Model(planar_parameters(paper, {}), 0.0, LEVELS)
    linear = linearise_period(model.planar, data.period)
    errors = data.errors(model, data.filter(model))[0]
    wild = errors.copy()
    wild[100:105] += 30 * LEVELS.sensors
    anything = NoiseModel(np.zeros(4), np.zeros(2)), NoiseModel(np.full(4, np.inf), np.full(2, np.inf))
    clean, shoved = [fit_noise(linear, LEVELS, [e], data.usable, anything, 30) for e in (errors, wild)]
    np.testing.assert_allclose(shoved.sensors, clean.sensors, rtol=0.15)


def test_torques_that_the_model_lacks_show_as_the_predictor_says(paper):
    push, period = 0.2, 30
    effects = {"periodic_disturbance": {"force": push / paper.wheel_radius, "frequency": 0.0, "phase": np.pi / 2}}
    pushed = synthetic_recording(paper, effects, seed=3, periods=period, tolerance=0.0)
    data = Data([pushed], 10)
    knows = Model(planar_parameters(paper, effects), 0.0, LEVELS)
    lacks = Model(planar_parameters(paper, {}), 0.0, LEVELS)
    kalman, linear = data.filter(lacks), linearise_period(lacks.planar, data.period)
    seen = data.errors(lacks, kalman)[0] - data.errors(knows, kalman)[0]
    (said,) = respond_each(linear.F, linear.C, kalman.gains, linear.B[:, 1].copy(), np.full((period, 1), push))
    assert np.abs(seen - said).max() < 0.05 * np.abs(said).max()


@pytest.mark.parametrize("has_discrepancy", [False, True])
def test_torques_leave_what_the_recursion_says(paper, has_discrepancy):
    """Each series by itself, with all entries of the matrices, as the truth."""
    noise = LEVELS._replace(discrepancy=np.full(6, 0.01)) if has_discrepancy else LEVELS
    linear = linearise_period(planar_parameters(paper, {}), 0.02)
    linear = linear.with_discrepancy(0.02, 3.0, 0.5) if has_discrepancy else linear
    gains = kalman_filter(linear, noise).gains
    torques = np.random.default_rng(0).standard_normal((80, 7))
    push = linear.B[:, 1].copy()
    together = respond_each(linear.F, linear.C, gains, push, torques)
    for found, series in zip(together, torques.T, strict=True):
        delta = np.zeros(len(linear.F))
        for n, error in enumerate(found):
            np.testing.assert_allclose(error, linear.C @ delta, rtol=1e-12, atol=1e-14)
            if n < len(series):
                K = gains[min(n, len(gains) - 1)]
                delta = linear.F @ (delta - K @ (linear.C @ delta)) + push * series[n]


@pytest.mark.parametrize("has_discrepancy", [False, True])
def test_regressions_on_what_torques_leave_have_the_sums_of_their_columns(paper, has_discrepancy):
    noise = LEVELS._replace(discrepancy=np.full(6, 0.01)) if has_discrepancy else LEVELS
    linear = linearise_period(planar_parameters(paper, {}), 0.02)
    linear = linear.with_discrepancy(0.02, 3.0, 0.5) if has_discrepancy else linear
    kalman, push, rng = kalman_filter(linear, noise), linear.B[:, 0].copy(), np.random.default_rng(1)
    torques, white = rng.standard_normal((80, 3, 5)), rng.standard_normal((80, 4))
    weights = np.where(rng.uniform(size=81) < 0.2, 0.0, rng.uniform(0.5, 1.5, 81))
    pull, squares = match_each(linear.F, linear.C, kalman.gains, push, torques, kalman.whiteners, weights, white)
    for i in range(5):
        left = respond_each(linear.F, linear.C, kalman.gains, push, torques[:, :, i].copy())
        X = whitened(kalman, [weights], [np.moveaxis(left, 0, 2)])
        np.testing.assert_allclose(pull[:, i], X.T @ white.ravel(), rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(squares[:, :, i], X.T @ X, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("sensed", [(True, True, True, True), (True, False, True, False), (True, True, True, False)])
def test_the_likelihood_is_that_of_as_many_channels_as_were_measured(paper, recording, sensed):
    """With scipy's density of Student's t, of the measured channels alone, as the truth."""
    sensed = np.array(sensed)
    model = Model(
        planar_parameters(paper, {}), 0.0, NoiseModel(np.where(sensed, LEVELS.sensors, UNSENSED), LEVELS.torques)
    )
    data = Data([replace(recording, sensed=sensed)], 10)
    kalman = data.filter(model)
    errors = data.errors(model, kalman)[0]
    rows = np.minimum(np.arange(1, len(errors)), len(kalman.whiteners) - 1)
    exact, found = [], []
    for scale in (1.0, 3.0):
        density = 0.0
        for error, W in zip(scale * errors[1:], kalman.whiteners[rows], strict=True):
            covariance = np.linalg.inv(W.T @ W)[np.ix_(sensed, sensed)]
            density += multivariate_t.logpdf(error[sensed], shape=0.8 * covariance, df=10.0)
        exact.append(-2.0 * density)
        found.append(cost([scale * errors], data.usable, kalman))
        white = whiten(scale * errors, recording.usable, kalman.whiteners, kalman.measured)
        assert np.sum(white**2) + np.sum(kalman.log_determinants[rows]) == pytest.approx(found[-1])
    assert found[1] - found[0] == pytest.approx(exact[1] - exact[0], rel=1e-3)


@pytest.mark.parametrize("name", library())
def test_the_linear_model_has_just_the_effects_that_say_so(paper, name):
    kind = library()[name]
    values = {name: {key: known.value for key, known in parameters_of(kind).items()}}
    nominal, found = (linearise_period(planar_parameters(paper, effects), 0.02) for effects in ({}, values))
    change = max(np.abs(there - here).max() for here, there in zip(nominal[:3], found[:3], strict=True))
    if kind.is_linear and name != "com_offset":  # which moves the balance, about which all is as before
        assert change > 1e-6
    else:
        assert change < 1e-7
