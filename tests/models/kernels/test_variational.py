"""Sparse posteriors by GPyTorch: against its inducing-point kernel, the exact fit, and its variational posterior."""

import resource
import sys
from dataclasses import replace

import gpytorch
import numpy as np
import pytest
import torch
from gpytorch_models import positive
from moment_matching import predict

from twbal.core.channels import Channels
from twbal.core.errors import ConfigError
from twbal.io.checkpoint import load_checkpoint, save_checkpoint
from twbal.models.dynamics import DynamicsModel
from twbal.models.fit import fit_gp
from twbal.models.fit_settings import FitSettings
from twbal.models.gp import GaussianProcess
from twbal.models.kernels.exact import condition, fit_prior
from twbal.models.kernels.induced import choose_inducing, condition_induced
from twbal.models.kernels.kernel_process import KernelProcess
from twbal.models.kernels.variational import VariationalSettings, fit_variational_gp, learn
from twbal.models.moments.truncation import Truncation
from twbal.search.transition import transition_model

FIT = FitSettings(2, 0.5, 60, 1, 40, 1000.0, 100.0)
SETTINGS = VariationalSettings(inducing=25, subset=60, steps=60, batch=100, rate=0.02, fit=FIT)
UNITS, TARGET_UNITS = np.array([0.01, 3.0]), np.array([1.0, 10.0])


def truth(inputs):
    z = inputs / UNITS
    return np.column_stack([np.sin(2 * z[:, 0]) + z[:, 1], np.tanh(z[:, 0] * z[:, 1])]) * TARGET_UNITS


def samples(n=600, seed=0):
    rng = np.random.default_rng(seed)
    inputs = rng.standard_normal((n, 2)) * UNITS
    return inputs, truth(inputs) + 0.1 * rng.standard_normal((n, 2)) * TARGET_UNITS


@pytest.fixture(scope="module")
def prior():
    return fit_prior(*samples(60), "matern52", FIT, seed=0)


def test_posterior_and_bound_equal_gpytorchs_inducing_point_kernel(prior):
    inputs, targets = samples(300)
    centres = choose_inducing(inputs, prior, 15, 0.0)
    process, bound = condition_induced(inputs, targets, centres, prior)
    at = samples(20, seed=3)[0]
    for a in range(2):
        size = prior.target_scales[a]
        likelihood = gpytorch.likelihoods.GaussianLikelihood(noise_constraint=positive()).double()
        likelihood.noise = torch.tensor(prior.noise_variance[a] / size**2)
        kernel = gpytorch.kernels.ScaleKernel(gpytorch.kernels.MaternKernel(nu=2.5, ard_num_dims=2)).double()
        kernel.outputscale = prior.module.outputscale[a]
        kernel.base_kernel.lengthscale = prior.module.base_kernel.lengthscale[a]
        scaled = torch.tensor(centres / prior.input_scales)
        induced = gpytorch.kernels.InducingPointKernel(kernel, scaled, likelihood)

        class Model(gpytorch.models.ExactGP):
            def __init__(self, x, y, likelihood=likelihood, induced=induced):
                super().__init__(x, y, likelihood)
                self.covar_module = induced

            def forward(self, x):
                return gpytorch.distributions.MultivariateNormal(
                    torch.zeros(len(x), dtype=x.dtype), self.covar_module(x)
                )

        x, y = torch.tensor(inputs / prior.input_scales), torch.tensor(targets[:, a] / size)
        model = Model(x, y).double().train()
        evidence = gpytorch.mlls.ExactMarginalLogLikelihood(likelihood, model)
        plain = gpytorch.settings.sgpr_diagonal_correction(False)  # see tests/models/test_sparse.py
        with torch.no_grad(), gpytorch.settings.fast_computations(False, False, False), plain:
            theirs = evidence(model(x), y).item() * len(y) - len(y) * np.log(size)
            mean = model.eval()(torch.tensor(at / prior.input_scales)).mean.numpy()
        assert bound[a] == pytest.approx(theirs, abs=0.2)  # each side has a jitter of its own
        np.testing.assert_allclose(process.predict(at).mean[:, a] / size, mean, atol=1e-3)


def test_every_sample_as_an_inducing_input_gives_the_exact_posterior(prior):
    inputs, targets = samples(80)
    process, bound = condition_induced(inputs, targets, inputs, prior)
    exact = condition(inputs, targets, prior)
    at = samples(20, seed=3)[0]
    np.testing.assert_allclose(bound, exact.log_evidence, atol=1e-2)
    ours, theirs = process.predict(at), exact.gp.predict(at)
    np.testing.assert_allclose(ours.mean / TARGET_UNITS, theirs.mean / TARGET_UNITS, atol=2e-3)  # by jitter
    np.testing.assert_allclose(ours.variance / TARGET_UNITS**2, theirs.variance / TARGET_UNITS**2, atol=1e-3)


def test_blocks_of_samples_give_what_all_at_once_give(prior, monkeypatch):
    inputs, targets = samples(300)
    centres = inputs[:20]
    whole = condition_induced(inputs, targets, centres, prior)
    monkeypatch.setattr("twbal.models.kernels.induced._BLOCK", 7)
    parts = condition_induced(inputs, targets, centres, prior)
    np.testing.assert_allclose(parts[1], whole[1], rtol=1e-9)
    np.testing.assert_allclose(parts[0].mean(inputs), whole[0].mean(inputs), atol=1e-6)


def test_minibatches_raise_the_bound_of_all_samples():
    inputs, targets = samples()
    before = fit_prior(inputs[:60], targets[:60], "se", FIT, seed=0)
    centres = choose_inducing(inputs, before, 12, 0.0)
    after, moved = learn(inputs, targets, centres, before, SETTINGS, seed=0)
    _, first = condition_induced(inputs, targets, centres, before)
    _, last = condition_induced(inputs, targets, moved, after)
    assert last.sum() > first.sum() + 5.0


@pytest.mark.parametrize(
    ("kernel", "kind"),
    [("se", GaussianProcess), pytest.param("matern52", KernelProcess, marks=pytest.mark.slow)],
)
def test_a_variational_fit_is_near_the_exact_one(kernel, kind):
    inputs, targets = samples()
    fit = fit_variational_gp(inputs, targets, SETTINGS, seed=0, kernel=kernel)
    assert isinstance(fit.gp, kind)
    assert len(fit.gp.centres) == 25
    at = samples(200, seed=5)[0]
    exact = fit_gp(inputs, targets, FIT, seed=0, kernel=kernel)
    found, best = (np.sqrt(np.mean((gp.mean(at) - truth(at)) ** 2, 0)) / TARGET_UNITS for gp in (fit.gp, exact.gp))
    assert (found < best + 0.05).all()
    noise = np.sqrt(fit.gp.noise_variance) / TARGET_UNITS
    assert ((noise > 0.09) & (noise < 0.15)).all()  # 0.1, and what so few inducing inputs cannot tell from it


def test_the_same_seed_gives_the_same_bits():
    one, other = (fit_variational_gp(*samples(200), replace(SETTINGS, steps=40), seed=4).gp for _ in range(2))
    assert np.array_equal(one.weights, other.weights)


def test_few_samples_are_fitted_exactly():
    inputs, targets = samples(24)
    fit = fit_variational_gp(inputs, targets, SETTINGS, seed=0)
    assert np.array_equal(fit.gp.weights, fit_gp(inputs, targets, FIT, seed=0).gp.weights)


def test_settings_that_cannot_be_right_are_refused():
    with pytest.raises(ConfigError, match="batch"):
        replace(SETTINGS, batch=0)


def dynamics(n, settings, tmp_path):
    """A model of 4 inputs with a variational f of n samples, from its checkpoint."""
    rng = np.random.default_rng(0)
    scales = np.array([0.3, 2.0, 1.0, 20.0])
    inputs = rng.uniform(-1, 1, (n, 4)) * scales
    change = 0.05 * np.column_stack([np.sin(inputs[:, 0]) - 0.01 * inputs[:, 3], inputs[:, 1] - inputs[:, 0]])
    targets = np.column_stack([change, 0.05 * np.tanh(inputs[:, 2])])
    noise = 0.1 * targets.std(axis=0)
    fit = fit_variational_gp(inputs, targets + noise * rng.standard_normal(targets.shape), settings, seed=0)
    channels = Channels(("tilt", "tilt_rate", "speed"), 0.15)
    model = DynamicsModel(channels, fit.gp, None, False, fit.gp.noise_variance, np.zeros(3))
    save_checkpoint(tmp_path / "model.pt", "model", model.to_payload())
    again = DynamicsModel.from_payload(load_checkpoint(tmp_path / "model.pt", "model"))
    assert np.array_equal(again.f.weights, fit.gp.weights)
    assert (np.abs(again.change(inputs[:500]) - targets[:500]).mean(axis=0) < 0.3 * noise).all()
    return again


def assert_moments_match(model):
    """Moments of f at an uncertain input, by moment matching and by Monte Carlo over that input."""
    mean, sd = np.array([0.05, 0.2, 0.1, 2.0]), np.array([0.05, 0.3, 0.2, 3.0])
    transition = transition_model(model)
    matched = predict(transition.f, transition.g, mean, np.diag(sd**2), Truncation())
    drawn = model.change(mean + sd * np.random.default_rng(1).standard_normal((20_000, 4)))
    spread = drawn.std(axis=0)
    np.testing.assert_allclose(matched.mean, drawn.mean(axis=0), atol=4 * spread.max() / np.sqrt(20_000))
    covariance = matched.slope @ np.diag(sd**2) @ matched.slope.T + matched.rest
    np.testing.assert_allclose(covariance / np.outer(spread, spread), np.corrcoef(drawn.T), atol=0.05)


def test_a_variational_f_is_kept_in_a_checkpoint_and_moment_matched(tmp_path):
    assert_moments_match(dynamics(2000, replace(SETTINGS, inducing=40, subset=150), tmp_path))


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no measure of memory")
def test_a_hundred_thousand_samples_fit_in_a_gigabyte(tmp_path):
    settings = VariationalSettings(
        inducing=200, subset=500, steps=300, batch=1000, rate=0.01, fit=replace(FIT, starts=5)
    )
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert_moments_match(dynamics(100_000, settings, tmp_path))
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 1e6  # kB
