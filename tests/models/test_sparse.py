from dataclasses import replace

import gpytorch
import numpy as np
import pytest
import torch
from gpytorch_models import exact_model

from twbal.core.errors import ConfigError, FitError
from twbal.models.bound import Bound
from twbal.models.evidence import Evidence
from twbal.models.fit import fit_gp
from twbal.models.fit_settings import FitSettings
from twbal.models.gp import condition, squared_exponential
from twbal.models.hyperparameters import Hyperparameters
from twbal.models.sparse import SparseSettings, choose_inducing, condition_sparse, fit_sparse_gp, greedy_choice

FIT = FitSettings(
    starts=2,
    perturbation=0.5,
    screening_points=100,
    finalists=1,
    iterations=100,
    max_signal_to_noise=1000.0,
    max_relative_length_scale=100.0,
)
SETTINGS = SparseSettings(inducing=60, subset=120, iterations=30, tolerance=1e-3, fit=FIT)
HYPER = Hyperparameters(np.array([[0.02, 2.0], [0.03, 5.0]]), np.array([1.5, 40.0]), np.array([0.01, 0.5]))
UNITS = np.array([0.01, 3.0])


def samples(n=300, seed=0):
    rng = np.random.default_rng(seed)
    z = rng.standard_normal((n, 2))
    clean = np.column_stack([np.sin(z[:, 0]) + z[:, 1], 10 * np.tanh(z[:, 1] * z[:, 0])])
    return (5.0 + z) * UNITS, clean + [0.1, 0.7] * rng.standard_normal((n, 2))


def test_gradient_of_the_bound_equals_finite_differences():
    inputs, targets = samples(60)
    bound, theta = Bound(inputs, targets[:, 0], inputs[:15]), HYPER.theta(0)
    numeric = [(bound(theta + 1e-5 * e)[0] - bound(theta - 1e-5 * e)[0]) / 2e-5 for e in np.eye(4)]
    np.testing.assert_allclose(bound(theta)[1], numeric, rtol=1e-5, atol=1e-5)


def test_bound_is_below_the_evidence_and_touches_it_when_every_sample_induces():
    inputs, targets = samples(60)
    evidence = Evidence(inputs, targets[:, 0])(HYPER.theta(0))[0]
    values = [Bound(inputs, targets[:, 0], inputs[:m])(HYPER.theta(0))[0] for m in (10, 30, 60)]
    assert values[0] < values[1] < values[2] < evidence
    assert values[2] == pytest.approx(evidence, abs=1e-3)


def test_prediction_and_bound_equal_gpytorchs_sparse_gp():
    inputs, targets = samples(80)
    centres = choose_inducing(inputs, HYPER, 12, 0.0)
    fit = condition_sparse(inputs, targets, centres, HYPER)
    at = inputs[:15] + 0.2 * UNITS
    for a in range(2):
        model = exact_model(inputs, targets[:, a], HYPER, a)
        model.covar_module = gpytorch.kernels.InducingPointKernel(
            model.covar_module, torch.tensor(centres), model.likelihood
        )
        evidence = gpytorch.mlls.ExactMarginalLogLikelihood(model.likelihood, model)
        # With its diagonal correction GPyTorch trains by Titsias' bound, but predicts by FITC; without, it predicts the
        # mean that the bound means, and leaves the part of the prior that the inducing inputs cannot see to the caller.
        plain = gpytorch.settings.sgpr_diagonal_correction(False)
        with torch.no_grad(), gpytorch.settings.fast_computations(False, False, False), plain:
            bound = evidence(model(*model.train_inputs), model.train_targets).item() * len(inputs)
            theirs = model.eval()(torch.tensor(at))
            variance = theirs.lazy_covariance_matrix.diagonal().numpy()
        assert fit.log_evidence[a] == pytest.approx(bound, rel=1e-5)
        ours = fit.gp.predict(at)
        np.testing.assert_allclose(ours.mean[:, a], theirs.mean, atol=1e-4 * targets[:, a].std())
        scales, signal = HYPER.length_scales[a], HYPER.signal_variance[a]
        cross = squared_exponential(at, centres, scales)
        seen = np.sum(cross * np.linalg.solve(squared_exponential(centres, centres, scales), cross.T).T, axis=1)
        np.testing.assert_allclose(ours.variance[:, a], variance + signal * (1 - seen), atol=1e-4 * signal)


def test_enough_inducing_inputs_give_the_exact_posterior():
    inputs, targets = samples(200)
    centres = choose_inducing(inputs, HYPER, 200, 1e-4)
    assert len(centres) < 150
    at = inputs[:20] + 0.3 * UNITS
    sparse = condition_sparse(inputs, targets, centres, HYPER).gp.predict(at)
    exact = condition(inputs, targets, *HYPER).predict(at)
    np.testing.assert_allclose(sparse.mean / targets.std(0), exact.mean / targets.std(0), atol=1e-3)
    np.testing.assert_allclose(
        sparse.variance / HYPER.signal_variance, exact.variance / HYPER.signal_variance, atol=1e-4
    )


def test_greedy_choice_beats_a_random_one():
    inputs, targets = samples(200)
    greedy = condition_sparse(inputs, targets, choose_inducing(inputs, HYPER, 25, 0.0), HYPER).log_evidence
    random = [condition_sparse(inputs, targets, inputs[k : k + 25], HYPER).log_evidence for k in range(0, 175, 25)]
    assert greedy.sum() > np.max(np.sum(random, axis=1))


def test_where_there_is_nothing_but_noise_one_input_is_left():
    """Samples of which even all together would tell next to nothing."""
    rows = lambda number: [np.eye(5)[number]]  # noqa: E731
    assert len(greedy_choice(rows, np.ones((1, 5)), np.array([1e-9]), count=3, tolerance=1e-3)) == 1


def test_fit_is_nearly_as_good_as_the_exact_fit_on_all_samples():
    inputs, targets = samples(300)
    fit = fit_sparse_gp(inputs, targets, SETTINGS, seed=0)
    assert fit.gp.centres.shape == (60, 2)
    exact = fit_gp(inputs, targets, FIT, seed=0)
    assert (fit.log_evidence < exact.log_evidence + 1e-3).all()
    assert (fit.log_evidence > exact.log_evidence - 1.0).all()


def test_repeated_samples_and_a_silent_target_leave_the_fit_finite():
    inputs, targets = samples(50)
    inputs, targets = np.tile(inputs, (4, 1)), np.tile(targets, (4, 1))
    targets[:, 1] = 0.0
    prediction = fit_sparse_gp(inputs, targets, SETTINGS, seed=0).gp.predict(inputs)
    assert np.isfinite(prediction.variance).all()
    np.testing.assert_allclose(prediction.mean[:, 1], 0.0, atol=1e-9)


def test_with_few_samples_the_fit_is_exact():
    inputs, targets = samples(40)
    sparse, exact = fit_sparse_gp(inputs, targets, SETTINGS, seed=0), fit_gp(inputs, targets, FIT, seed=0)
    assert np.array_equal(sparse.gp.weights, exact.gp.weights)


def test_too_few_samples_are_refused():
    inputs, targets = samples(3)
    with pytest.raises(FitError, match="found 3"):
        fit_sparse_gp(inputs, targets, SETTINGS, seed=0)


def test_no_inducing_inputs_are_refused():
    with pytest.raises(ConfigError, match="inducing"):
        SparseSettings(inducing=0, subset=10, iterations=0, tolerance=0.0, fit=FIT)


def test_an_output_with_too_few_inducing_inputs_is_not_taken_for_noise():
    """Of a wiggly output twelve inducing inputs tell nothing, and their bound is highest where all of it is noise."""
    rng = np.random.default_rng(3)
    inputs = rng.uniform(-1.0, 1.0, (400, 2))
    wiggly = np.sin(9.0 * inputs[:, 0]) * np.cos(9.0 * inputs[:, 1])
    targets = np.column_stack([wiggly, inputs[:, 0]]) + 0.02 * rng.standard_normal((400, 2))
    found = fit_sparse_gp(inputs, targets, replace(SETTINGS, inducing=12, subset=200), seed=0).gp
    assert np.sqrt(found.noise_variance[0]) < 0.05
    assert np.sqrt(found.noise_variance[1]) == pytest.approx(0.02, rel=0.2)
    bound = Bound(inputs, targets[:, 0], found.centres)
    hyper = Hyperparameters(found.length_scales, found.signal_variance, found.noise_variance)
    noise_alone = np.append(hyper.theta(0)[:2], np.log([1e-3, wiggly.std()]))
    assert bound(noise_alone)[0] > bound(hyper.theta(0))[0]
