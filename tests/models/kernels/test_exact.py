"""Fits with any kernel against the closed form, quadrature and plain linear algebra."""

import gpytorch
import numpy as np
import pytest
import torch
from gpytorch_models import positive
from numpy.polynomial.hermite_e import hermegauss

from twbal.core.errors import CheckpointError, ConfigError, FitError
from twbal.models.dynamics import posterior_from_payload
from twbal.models.fit import fit_gp
from twbal.models.fit_settings import FitSettings, LogNormalPrior, PriorReference
from twbal.models.gp import GaussianProcess
from twbal.models.kernels.exact import fit_prior
from twbal.models.kernels.kernel_process import KernelProcess
from twbal.models.sparse import SparseSettings, fit_sparse_gp

VALUES = {
    "starts": 2,
    "perturbation": 0.5,
    "screening_points": 60,
    "finalists": 1,
    "iterations": 60,
    "max_signal_to_noise": 1000.0,
    "max_relative_length_scale": 100.0,
}
SETTINGS = FitSettings(**VALUES)
UNITS, TARGET_UNITS = np.array([0.01, 200.0]), np.array([1e-3, 50.0])


def truth(z):
    return np.column_stack([np.sin(2 * z[:, 0]) + z[:, 1], np.abs(z[:, 0]) * z[:, 1]])


def samples(n=80, seed=0, noise=0.1):
    rng = np.random.default_rng(seed)
    z = rng.standard_normal((n, 2))
    return z * UNITS, (truth(z) + noise * rng.standard_normal((n, 2))) * TARGET_UNITS


@pytest.fixture(scope="module")
def matern():
    return fit_gp(*samples(), SETTINGS, seed=0, kernel="matern52")


def test_the_se_kernel_by_gpytorch_has_the_evidence_of_the_closed_form():
    inputs, targets = samples()
    by_hand = fit_gp(inputs, targets, SETTINGS, seed=0)
    by_gpytorch = fit_gp(inputs, targets, SETTINGS, seed=0, kernel="RBFKernel")
    np.testing.assert_allclose(by_gpytorch.log_evidence, by_hand.log_evidence, atol=0.5)
    at = inputs[:20] + 0.3 * UNITS
    ours, theirs = by_hand.gp.predict(at), by_gpytorch.gp.predict(at)
    np.testing.assert_allclose(theirs.mean / TARGET_UNITS, ours.mean / TARGET_UNITS, atol=0.03)
    np.testing.assert_allclose(theirs.variance / TARGET_UNITS**2, ours.variance / TARGET_UNITS**2, atol=3e-3)


def test_prediction_and_evidence_equal_gpytorchs_in_raw_units(matern):
    inputs, targets = samples()
    at = torch.tensor((inputs[:15] + 0.3 * UNITS) / matern.gp.input_scales)
    for a in range(2):
        size = matern.gp.target_scales[a]
        kernel = gpytorch.kernels.ScaleKernel(gpytorch.kernels.MaternKernel(nu=2.5, ard_num_dims=2)).double()
        kernel.outputscale = matern.gp.module.outputscale[a]
        kernel.base_kernel.lengthscale = matern.gp.module.base_kernel.lengthscale[a]
        likelihood = gpytorch.likelihoods.GaussianLikelihood(noise_constraint=positive()).double()
        likelihood.noise = torch.tensor(matern.gp.noise_variance[a] / size**2)

        class Model(gpytorch.models.ExactGP):
            def forward(self, x, kernel=kernel):
                return gpytorch.distributions.MultivariateNormal(torch.zeros(len(x), dtype=x.dtype), kernel(x))

        x, y = torch.tensor(inputs / matern.gp.input_scales), torch.tensor(targets[:, a] / size)
        model = Model(x, y, likelihood).double()
        with torch.no_grad(), gpytorch.settings.fast_computations(False, False, False):
            evidence = likelihood(model.train()(x)).log_prob(y).item() - len(y) * np.log(size)
            theirs = model.eval()(at)
        ours = matern.gp.predict(at.numpy() * matern.gp.input_scales)
        assert matern.log_evidence[a] == pytest.approx(evidence, abs=1e-5)
        np.testing.assert_allclose(ours.mean[:, a] / size, theirs.mean, atol=1e-7)
        np.testing.assert_allclose(ours.variance[:, a] / size**2, theirs.variance, atol=1e-7)


def test_a_matern_fit_recovers_a_function_to_within_its_own_error_bars(matern):
    """Mean squared error over N(0, I) by Gauss-Hermite quadrature, against the posterior's own and the function's."""
    nodes, weights = hermegauss(20)
    z = np.stack(np.meshgrid(nodes, nodes), axis=-1).reshape(-1, 2)
    weights = np.outer(weights, weights).ravel() / (2 * np.pi)
    found = matern.gp.predict(z * UNITS)
    clean = truth(z)
    squares = weights @ (found.mean / TARGET_UNITS - clean) ** 2
    spread = weights @ clean**2 - (weights @ clean) ** 2
    expected = weights @ (found.variance / TARGET_UNITS**2)
    assert (squares < 0.05 * spread).all()
    assert (squares < 4.0 * expected).all()


def test_slope_equals_finite_differences(matern):
    at = samples(7, seed=3)[0]
    slope = matern.gp.slope(at)
    for k in range(2):
        h = 1e-6 * UNITS[k] * np.eye(2)[k]
        numeric = (matern.gp.mean(at + h) - matern.gp.mean(at - h)) / 2e-6
        np.testing.assert_allclose(slope[:, :, k] * UNITS[k] / TARGET_UNITS, numeric / TARGET_UNITS, atol=1e-5)


def test_a_linear_kernel_continues_a_line_where_a_stationary_one_falls_back_to_zero():
    x = np.linspace(-1, 1, 40)[:, None] * [[1.0, 0.5]] + 0.1 * np.random.default_rng(0).standard_normal((40, 2))
    y = (3.0 * x[:, :1]) + 0.01 * np.random.default_rng(1).standard_normal((40, 1))
    far = np.array([[30.0, 0.0]])
    both, alone = (fit_gp(x, y, SETTINGS, 0, kernel=kernel).gp.mean(far)[0, 0] for kernel in ("se+linear", "matern32"))
    assert both == pytest.approx(90.0, rel=0.05)
    assert abs(alone) < 80.0


def test_a_prior_on_length_scales_and_noise_wins_over_few_data():
    inputs, targets = samples(12)
    priors = {"length_scale_prior": LogNormalPrior(np.log(2.0), 0.01), "noise_prior": LogNormalPrior(0.0, 0.01)}
    reference = PriorReference(np.array([[0.01, 50.0], [0.02, 300.0]]), 0.2 * TARGET_UNITS)
    found = fit_prior(inputs, targets, "matern32", FitSettings(**VALUES, **priors), 0, reference)
    lengths = found.module.base_kernel.lengthscale[:, 0, :].numpy() * found.input_scales
    np.testing.assert_allclose(lengths, 2.0 * reference.length_scales, rtol=0.05)
    np.testing.assert_allclose(np.sqrt(found.noise_variance), reference.noise_sd, rtol=0.05)


@pytest.mark.parametrize("constant", [0.0, 3.7])
def test_constant_columns_and_targets_give_finite_models(constant):
    inputs, _ = samples(n=20)
    inputs[:, 1] = constant
    targets = np.column_stack([np.full(20, constant), inputs[:, 0]])
    prediction = fit_gp(inputs, targets, SETTINGS, seed=0, kernel="matern52").gp.predict(inputs)
    assert np.isfinite(prediction.variance).all()
    np.testing.assert_allclose(prediction.mean, targets, atol=0.05 * max(constant, np.ptp(inputs[:, 0])))


def test_the_same_seed_gives_the_same_bits(matern):
    again = fit_gp(*samples(), SETTINGS, seed=0, kernel="matern52")
    assert np.array_equal(again.gp.weights, matern.gp.weights)


def test_a_posterior_survives_its_payload(matern):
    again = posterior_from_payload(matern.gp.to_payload())
    assert isinstance(again, KernelProcess)
    at = samples(5, seed=2)[0]
    assert np.array_equal(again.predict(at).mean, matern.gp.predict(at).mean)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("kernel", "__import__('os')", "kernel cannot be made"),
        ("kernel", "rq", "raw_alpha"),
        ("input_scales", np.zeros(2), "input_scales must be within"),
        ("parameters", {}, "raw_outputscale"),
    ],
)
def test_a_payload_that_is_none_is_refused(matern, name, value, message):
    with pytest.raises(CheckpointError, match=message):
        posterior_from_payload({**matern.gp.to_payload(), name: value})


def test_an_unknown_kernel_is_refused_before_anything_is_fitted():
    with pytest.raises(ConfigError, match="there is no kernel 'mattern'"):
        fit_gp(*samples(), SETTINGS, seed=0, kernel="mattern")


def test_too_few_samples_say_how_many_are_needed():
    with pytest.raises(FitError, match="found 3, and 2 inputs need at least 4"):
        fit_gp(*samples(3), SETTINGS, seed=0, kernel="matern52")


def test_a_sparse_fit_with_another_kernel_is_near_the_exact_one_and_below_its_evidence():
    inputs, targets = samples(150)
    sparse = SparseSettings(inducing=70, subset=150, iterations=0, tolerance=1e-3, fit=SETTINGS)
    few = fit_sparse_gp(inputs, targets, sparse, seed=0, kernel="matern52")
    exact = fit_gp(inputs, targets, SETTINGS, seed=0, kernel="matern52")
    assert len(few.gp.centres) <= 70
    assert (few.log_evidence < exact.log_evidence + 0.5).all()
    at = samples(30, seed=5)[0]
    ours, theirs = few.gp.predict(at), exact.gp.predict(at)
    np.testing.assert_allclose(ours.mean / TARGET_UNITS, theirs.mean / TARGET_UNITS, atol=0.1)


def test_the_default_kernel_is_the_one_by_hand():
    assert isinstance(fit_gp(*samples(20), SETTINGS, seed=0).gp, GaussianProcess)
