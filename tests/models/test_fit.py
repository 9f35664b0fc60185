import subprocess
import sys
import warnings
from dataclasses import replace

import gpytorch
import numpy as np
import pytest
import torch
from gpytorch_models import exact_model, log_evidence

from twbal.core.errors import ConfigError, FitError
from twbal.models.evidence import Evidence
from twbal.models.fit import fit_gp
from twbal.models.fit_objective import FitObjective
from twbal.models.fit_settings import FitSettings, LogNormalPrior, PriorReference, input_scales
from twbal.models.gp import condition, squared_exponential
from twbal.models.hyperparameters import Hyperparameters

VALUES = {
    "starts": 4,
    "perturbation": 1.0,
    "screening_points": 150,
    "finalists": 2,
    "iterations": 100,
    "max_signal_to_noise": 1000.0,
    "max_relative_length_scale": 100.0,
}
SETTINGS = FitSettings(**VALUES)
UNITS = np.array([0.01, 3.0, 200.0])  # one input in hundredths, one in hundreds
TARGET_UNITS = np.array([1e-3, 50.0])


def samples(n=80, seed=0, noise=0.1):
    rng = np.random.default_rng(seed)
    z = rng.standard_normal((n, 3))
    clean = np.column_stack([np.sin(2 * z[:, 0]) + z[:, 1], np.tanh(z[:, 1] * z[:, 0]) + 0.5])
    return 5.0 * UNITS + z * UNITS, (clean + noise * rng.standard_normal((n, 2))) * TARGET_UNITS


def of(gp):
    return Hyperparameters(gp.length_scales, gp.signal_variance, gp.noise_variance)


@pytest.mark.parametrize("n", [80, 300])  # on all samples at once, and on some of them first
def test_a_fit_goes_on_from_one_to_much_the_same_samples_and_from_the_usual_start(monkeypatch, n):
    evaluated, evaluate = [], Evidence.__call__
    monkeypatch.setattr(Evidence, "__call__", lambda self, theta: evaluated.append(theta) or evaluate(self, theta))
    inputs, targets = samples(n)
    before = of(fit_gp(*samples(n, noise=0.12), SETTINGS, seed=0).gp)
    evaluated.clear()
    anew = fit_gp(inputs, targets, SETTINGS, seed=0)
    count = len(evaluated)
    evaluated.clear()
    on = fit_gp(inputs, targets, SETTINGS, seed=0, near=before)
    assert len(evaluated) < 0.8 * count
    np.testing.assert_allclose(on.log_evidence, anew.log_evidence, atol=0.05)
    all_is_noise = Hyperparameters(30.0 * before.length_scales, 1e-4 * before.signal_variance, targets.var(axis=0))
    misled = fit_gp(inputs, targets, SETTINGS, seed=0, near=all_is_noise)
    np.testing.assert_allclose(misled.log_evidence, anew.log_evidence, atol=0.05)


@pytest.mark.parametrize("theta", [[0.0, 0.5, -0.3, 1.0, -1.0], [2.0, 3.0, 1.0, 6.0, -6.0]])
def test_evidence_and_its_gradient_equal_gpytorchs(theta):
    inputs, targets = samples()
    inputs, target, theta = (inputs - inputs.mean(0)) / UNITS, targets[:, 0] / TARGET_UNITS[0], np.array(theta)
    noise = np.exp(2 * theta[-1])
    hyper = Hyperparameters(np.exp(theta[None, :3]), np.array([noise * np.exp(2 * theta[3])]), np.array([noise]))
    model = exact_model(inputs, target, hyper, 0)
    expected = log_evidence(model)
    expected.backward()
    scales = model.covar_module.base_kernel.raw_lengthscale.grad.numpy()[0]
    signal = 2 * model.covar_module.raw_outputscale.grad.item()  # log α² = 2 (log α/σ + log σ)
    sigma = signal + 2 * model.likelihood.noise_covar.raw_noise.grad.item()
    value, gradient = Evidence(inputs, target)(theta)
    assert value == pytest.approx(expected.item(), rel=1e-9)
    np.testing.assert_allclose(gradient, [*scales, signal, sigma], rtol=1e-6, atol=1e-6)


def test_gradient_equals_finite_differences():
    inputs, targets = samples()
    evidence, theta = Evidence(inputs / UNITS, targets[:, 1] / TARGET_UNITS[1]), np.array([0.1, 0.6, 1.0, 1.5, -1.2])
    numeric = [(evidence(theta + 1e-5 * e)[0] - evidence(theta - 1e-5 * e)[0]) / 2e-5 for e in np.eye(5)]
    np.testing.assert_allclose(evidence(theta)[1], numeric, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("noise", [0.3, 1e-4])
def test_prediction_equals_gpytorchs_posterior_in_raw_units(noise):
    inputs, targets = samples(noise=noise)
    gp = fit_gp(inputs, targets, SETTINGS, seed=0).gp
    at = inputs[:20] + 0.3 * UNITS * np.random.default_rng(1).standard_normal((20, 3))
    ours = gp.predict(at)
    for a in range(2):
        model = exact_model(inputs, targets[:, a], of(gp), a).eval()
        with torch.no_grad(), gpytorch.settings.fast_computations(False, False, False):
            theirs = model(torch.tensor(at))
        np.testing.assert_allclose(ours.mean[:, a], theirs.mean, atol=1e-6 * TARGET_UNITS[a])
        np.testing.assert_allclose(
            ours.variance[:, a], theirs.lazy_covariance_matrix.diagonal(), atol=1e-6 * TARGET_UNITS[a] ** 2
        )


@pytest.mark.slow
def test_no_optimiser_of_gpytorch_finds_more_evidence():
    inputs, targets = samples(n=40)
    unpenalised = FitSettings(**{**VALUES, "max_relative_length_scale": 1e5})
    found = fit_gp(inputs, targets, unpenalised, seed=0)
    z, y = (inputs - inputs.mean(0)) / inputs.std(0), targets / targets.std(0)
    for a in range(2):
        start = Hyperparameters(np.ones((2, 3)), np.ones(2), np.full(2, 0.01))
        model = exact_model(z, y[:, a], start, a)
        adam = torch.optim.Adam(model.parameters(), lr=0.1)
        for _ in range(300):
            adam.zero_grad()
            loss = -log_evidence(model) / len(z)
            loss.backward()
            adam.step()
        theirs = -loss.item() * len(z) - len(z) * np.log(targets[:, a].std())
        assert found.log_evidence[a] > theirs - 0.05


def test_hyperparameters_of_a_drawn_function_are_recovered():
    rng = np.random.default_rng(0)
    inputs, scales = rng.uniform(-3, 3, (300, 2)), np.array([0.8, 2.5])
    covariance = 4.0 * squared_exponential(inputs, inputs, scales) + 0.01 * np.eye(300)
    target = np.linalg.cholesky(covariance) @ rng.standard_normal(300)
    gp = fit_gp(inputs, target[:, None], SETTINGS, seed=0).gp
    np.testing.assert_allclose(gp.length_scales[0], scales, rtol=0.2)
    assert np.sqrt(gp.noise_variance[0]) == pytest.approx(0.1, rel=0.15)


def test_units_only_rescale_the_fit():
    inputs, targets = samples()
    raw, scaled = (fit_gp(x, y, SETTINGS, 0).gp for x, y in ((inputs, targets), (inputs / UNITS, targets / 7.0)))
    np.testing.assert_allclose(raw.length_scales, scaled.length_scales * UNITS, rtol=1e-3)
    np.testing.assert_allclose(raw.noise_variance, scaled.noise_variance * 49.0, rtol=1e-3)


def test_the_same_seed_gives_the_same_fit():
    inputs, targets = samples(n=200)
    one, other = (fit_gp(inputs, targets, SETTINGS, seed=3).gp for _ in range(2))
    assert np.array_equal(one.weights, other.weights)


def test_of_starts_that_end_at_one_optimum_one_goes_on_on_all_samples(monkeypatch):
    polish, begins = FitObjective.polish, []

    def counted(objective, evidence, start, *settings):
        begins.append(start)
        return polish(objective, evidence, start, *settings)

    monkeypatch.setattr(FitObjective, "polish", counted)
    inputs, targets = samples(200)
    alone = fit_gp(inputs, targets, replace(SETTINGS, finalists=1), seed=0)
    assert len(begins) == 2  # one for each output
    together = fit_gp(inputs, targets, SETTINGS, seed=0)
    assert len(begins) == 4
    np.testing.assert_array_equal(together.log_evidence, alone.log_evidence)


def test_searches_that_begin_on_choices_of_their_own_end_where_searches_on_all_samples_do():
    inputs, targets = samples(n=200)
    on_all = fit_gp(inputs, targets, FitSettings(**{**VALUES, "screening_points": 200}), seed=0).log_evidence
    own = fit_gp(inputs, targets, FitSettings(**{**VALUES, "screening_points": 100}, own_choices=4), seed=0)
    np.testing.assert_allclose(own.log_evidence, on_all, atol=0.01)


@pytest.mark.slow
def test_choices_of_their_own_show_an_optimum_that_a_common_choice_hides():
    rng = np.random.default_rng(1003)
    inputs = rng.uniform(-1.0, 1.0, (1000, 4)) * [0.5, 3.0, 3.0, 1.0]
    clean = 0.05 * (15.0 * np.sin(inputs[:, 0]) - 4.0 * inputs[:, 3] - 0.2 * inputs[:, 1])
    target = (clean + 0.02 * rng.standard_normal((1000, 3))[:, 1])[:, None]
    free = {**VALUES, "screening_points": 300, "max_signal_to_noise": 1e5, "max_relative_length_scale": 1e6}
    common = fit_gp(inputs, target, FitSettings(**{**free, "starts": 5}), seed=0).log_evidence
    own = fit_gp(inputs, target, FitSettings(**free, own_choices=8), seed=0).log_evidence
    assert own > common + 1.0


def test_penalties_hold_noiseless_data_and_idle_inputs():
    inputs = np.random.default_rng(0).standard_normal((60, 2))
    gp = fit_gp(inputs, np.sin(inputs[:, :1]), SETTINGS, seed=0).gp
    assert np.sqrt(gp.signal_variance / gp.noise_variance)[0] < 2000
    assert gp.length_scales[0, 1] < 200 * inputs[:, 1].std()


@pytest.mark.parametrize("constant", [0.0, 3.7])
def test_constant_columns_and_targets_give_finite_models(constant):
    inputs, _ = samples(n=20)
    inputs[:, 1] = constant
    targets = np.column_stack([np.full(20, constant), inputs[:, 0]])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        gp = fit_gp(inputs, targets, SETTINGS, seed=0).gp
    prediction = gp.predict(inputs)
    assert np.isfinite(gp.length_scales).all()
    assert np.isfinite(prediction.variance).all()
    np.testing.assert_allclose(prediction.mean, targets, atol=0.02 * max(constant, np.ptp(inputs[:, 0])))


def test_a_strong_length_scale_prior_wins_over_the_data():
    inputs, targets = samples(n=15)
    settings = FitSettings(**VALUES, length_scale_prior=LogNormalPrior(np.log(2.0), 0.01))
    reference = PriorReference(np.array([[0.01, 1.0, 50.0], [0.02, 5.0, 300.0]]), np.ones(2))
    gp = fit_gp(inputs, targets, settings, seed=0, reference=reference).gp
    np.testing.assert_allclose(gp.length_scales, 2.0 * reference.length_scales, rtol=0.05)


def test_a_noise_prior_is_in_the_targets_units():
    inputs, targets = samples(n=15)
    settings = FitSettings(**VALUES, noise_prior=LogNormalPrior(0.0, 0.01))
    reference = PriorReference(np.tile(UNITS, (2, 1)), np.array([0.2, 0.3]) * TARGET_UNITS)
    gp = fit_gp(inputs, targets, settings, seed=0, reference=reference).gp
    np.testing.assert_allclose(np.sqrt(gp.noise_variance), reference.noise_sd, rtol=0.05)


def test_a_vague_prior_changes_nothing():
    inputs, targets = samples()
    vague = FitSettings(**VALUES, length_scale_prior=LogNormalPrior(0.0, 1e4), noise_prior=LogNormalPrior(0.0, 1e4))
    with_prior, without = (fit_gp(inputs, targets, s, seed=0) for s in (vague, SETTINGS))
    np.testing.assert_allclose(with_prior.log_evidence, without.log_evidence, atol=1e-2)


def test_reported_evidence_is_the_density_of_the_targets():
    inputs, targets = samples(n=30)
    fit = fit_gp(inputs, targets, SETTINGS, seed=0)
    for a in range(2):
        covariance = fit.gp.signal_variance[a] * squared_exponential(inputs, inputs, fit.gp.length_scales[a])
        covariance += fit.gp.noise_variance[a] * np.eye(30)
        _, log_determinant = np.linalg.slogdet(2 * np.pi * covariance)
        density = -0.5 * (log_determinant + targets[:, a] @ np.linalg.solve(covariance, targets[:, a]))
        assert fit.log_evidence[a] == pytest.approx(density, abs=1e-5)
        assert fit.log_evidence[a] == pytest.approx(
            log_evidence(exact_model(inputs, targets[:, a], of(fit.gp), a)).item()
        )


def test_too_few_samples_say_how_many_are_needed():
    inputs, targets = samples(n=4)
    with pytest.raises(FitError, match="found 4, and 3 inputs need at least 5"):
        fit_gp(inputs, targets, SETTINGS, seed=0)


def test_a_nan_is_named_by_its_row():
    inputs, targets = samples()
    targets[17, 1] = np.nan
    with pytest.raises(FitError, match="Sample 17 of the targets"):
        fit_gp(inputs, targets, SETTINGS, seed=0)


def test_targets_of_another_length_are_refused():
    inputs, targets = samples()
    with pytest.raises(FitError, match=r"\(80, 3\) and \(79, 2\)"):
        fit_gp(inputs, targets[1:], SETTINGS, seed=0)


@pytest.mark.parametrize(("name", "value"), [("starts", 0), ("own_choices", -1), ("max_signal_to_noise", 1.0)])
def test_settings_that_cannot_be_right_are_refused(name, value):
    with pytest.raises(ConfigError, match=name):
        FitSettings(**{**VALUES, name: value})


@pytest.mark.parametrize("seed", range(5))
def test_evidence_equals_gpytorchs_wherever_a_fit_may_end(seed):
    inputs, targets = samples(n=200)
    rng = np.random.default_rng(seed)
    scales, spread = inputs.std(0) * 10.0 ** rng.uniform(-1, 2, (1, 3)), targets[:, 0].std()  # up to the fit's limits
    noise = np.array([(spread * 10.0 ** rng.uniform(-4, 0)) ** 2])
    hyper = Hyperparameters(scales, noise * 10.0 ** rng.uniform(0, 6, 1), noise)
    ours, _ = Evidence(inputs, targets[:, 0])(hyper.theta(0))
    theirs = log_evidence(exact_model(inputs, targets[:, 0], hyper, 0)).item()
    assert ours == pytest.approx(theirs, rel=1e-6, abs=1e-3)


def test_a_covariance_too_badly_conditioned_has_no_evidence_and_is_refused_with_advice():
    inputs, targets = samples()
    hyper = Hyperparameters(np.tile(1000 * UNITS, (2, 1)), np.ones(2), np.full(2, 1e-18))
    assert Evidence(inputs, targets[:, 0])(hyper.theta(0))[0] == -np.inf
    with pytest.raises(FitError, match="Lower the largest signal-to-noise ratio"):
        condition(inputs, targets, *hyper)


def test_the_default_kernel_is_fitted_without_importing_gpytorch():
    code = "import sys, twbal.models.recipe, twbal.models.sparse, twbal.search.task; print('gpytorch' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


@pytest.mark.parametrize("kernel", ["se", "matern52"])
def test_an_input_that_changes_by_rounding_alone_is_one_that_never_changes(kernel):
    """As 0.1 + 0.2 and 0.3: such a length-scale would forget all data a hundredth away."""
    rng = np.random.default_rng(1)
    inputs = rng.standard_normal((40, 3))
    inputs[:, 1] = 0.3
    targets = np.sin(inputs[:, :1]) + 0.05 * rng.standard_normal((40, 1))
    rounded = inputs.copy()
    rounded[5:, 1] = 0.1 + 0.2
    away = inputs.copy()
    away[:, 1] = 0.31
    quick = replace(SETTINGS, starts=2, iterations=15)
    still, found = (fit_gp(each, targets, quick, 0, kernel=kernel).gp for each in (inputs, rounded))
    np.testing.assert_allclose(found.mean(away), still.mean(away), atol=1e-6)
    assert np.abs(found.mean(away) - targets).max() < 0.3


def test_the_scale_of_an_input_is_its_standard_deviation_however_little_it_changes_beside_rounding():
    inputs = np.random.default_rng(0).standard_normal((30, 4)) * [1.0, 1e-12, 1e-7, 1e-12] + [0.0, 0.0, 5.0, 5.0]
    scales = input_scales(np.column_stack([inputs, np.zeros(30)]))
    np.testing.assert_array_equal(scales[:3], inputs[:, :3].std(axis=0))
    np.testing.assert_allclose(scales[3:], [5.0, 1.0])
