"""Functions drawn from posteriors with any kernel: their statistics are those of the posterior."""

import numpy as np
import pytest
import torch

from twbal.core.errors import FitError
from twbal.models.fit_settings import FitSettings
from twbal.models.kernels.exact import condition
from twbal.models.kernels.expression import build
from twbal.models.kernels.induced import choose_inducing, condition_induced
from twbal.models.kernels.kernel_process import prior_process
from twbal.models.kernels.prior import Interpolated, Waves, _root, draw_prior
from twbal.models.kernels.samples import KernelSamples

COUNT = 3000
WAVES = ["se", "matern12", "matern32", "matern52", "rq", "linear", "se+linear", "matern52*rq", "matern32+rq"]
ANCHORED = ["periodic", "quadratic", "compact", "se*linear"]
SETTINGS = FitSettings(1, 0.5, 60, 1, 20, 1000.0, 100.0)


def prior(kernel, noise=0.02):
    """Two outputs with parameters of their own."""
    rng = np.random.default_rng(5)
    module = build(kernel, 2, 2)
    parameters = {name: 0.4 * rng.standard_normal(raw.shape) for name, raw in module.named_parameters()}
    noises = noise * np.array([1.0, 100.0])
    return prior_process(kernel, parameters, np.array([1.0, 3.0]), np.array([1.0, 10.0]), noises)


def data(n=12):
    rng = np.random.default_rng(1)
    inputs = rng.uniform(-1.5, 1.5, (n, 2)) * [1.0, 3.0]
    targets = np.column_stack([np.sin(inputs[:, 0]), 10 * np.cos(inputs[:, 1])])
    return inputs, targets + rng.standard_normal((n, 2)) * [0.1, 1.0]


def check_covariance(kernel, features, kind):
    """That of functions which are drawn in one of the two ways, against the kernel's."""
    module = prior(kernel).module
    places = torch.tensor(np.random.default_rng(2).uniform(-1.5, 1.5, (5, 2)))
    drawn = draw_prior(module, places, COUNT, features, np.random.default_rng(3))
    assert isinstance(drawn, kind)
    found = drawn.at(places).numpy()
    expected = module(places, places).to_dense().numpy()
    top = expected.max(axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(found @ found.transpose(0, 2, 1) / COUNT / top, expected / top, atol=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("kernel", WAVES)
def test_waves_have_the_kernels_covariance(kernel):
    check_covariance(kernel, 4000, Waves)


@pytest.mark.parametrize("kernel", ANCHORED)
def test_other_kernels_are_exact_at_their_centres(kernel):
    check_covariance(kernel, 50, Interpolated)


@pytest.mark.parametrize("kernel", ["matern52", "se+linear", "periodic"])
def test_functions_have_the_posteriors_mean_and_variance(kernel):
    process = condition(*data(), prior(kernel)).gp
    drawn = KernelSamples.draw(process, COUNT, 40 if kernel in ANCHORED else 1500, np.random.default_rng(0))
    for place in np.array([[0.0, 0.0], [1.0, -2.0], [1.5, 4.0]]):
        mean, variance = (values[0] for values in process.predict(place[None]))
        values = drawn(torch.tensor(np.tile(place, (COUNT, 1)))).numpy()
        assert (np.abs(values.mean(0) - mean) < 4.5 * np.sqrt(variance / COUNT)).all()
        features = 0.02 * process.prior_variance(place[None])[:, 0]  # the error of so many
        assert (np.abs(values.var(0) - variance) < 0.15 * variance + features).all()


def test_functions_of_a_sparse_posterior_have_its_mean_and_variance():
    inputs, targets = data(80)
    start = prior("matern52")
    process, _ = condition_induced(inputs, targets, choose_inducing(inputs, start, 12, 0.0), start)
    drawn = KernelSamples.draw(process, COUNT, 1500, np.random.default_rng(0))
    for place in np.array([[0.0, 0.0], [1.0, -2.0], [2.5, 4.0]]):
        mean, variance = (values[0] for values in process.predict(place[None]))
        values = drawn(torch.tensor(np.tile(place, (COUNT, 1)))).numpy()
        assert (np.abs(values.mean(0) - mean) < 4.5 * np.sqrt(variance / COUNT)).all()
        features = 0.02 * process.prior_variance(place[None])[:, 0]  # the error of so many
        assert (np.abs(values.var(0) - variance) < 0.15 * variance + features).all()


@pytest.mark.parametrize("kernel", ["matern52", "periodic"])
def test_a_function_depends_on_its_own_input_alone_and_repeats_by_its_seed(kernel):
    process = condition(*data(), prior(kernel)).gp
    inputs = torch.tensor(np.random.default_rng(2).standard_normal((6, 2)))
    one, other = (KernelSamples.draw(process, 6, 40, np.random.default_rng(7)) for _ in range(2))
    assert torch.equal(one(inputs), other(inputs))
    moved = inputs.clone()
    moved[1:] += 1.0
    torch.testing.assert_close(one(moved)[0], one(inputs)[0])


def test_the_gradient_by_the_inputs_is_that_of_finite_differences():
    drawn = KernelSamples.draw(condition(*data(), prior("matern52+linear")).gp, 3, 40, np.random.default_rng(7))
    inputs = torch.tensor(np.random.default_rng(2).standard_normal((3, 2)), requires_grad=True)
    assert torch.autograd.gradcheck(drawn, (inputs,), eps=1e-6, atol=1e-4)


def covariance(least):
    """One of 12 places whose largest variance is 1, and whose least eigenvalue is as given."""
    turned = np.linalg.qr(np.random.default_rng(0).standard_normal((12, 12)))[0]
    matrix = turned * np.append(np.linspace(0.1, 1.0, 11), least) @ turned.T
    return torch.tensor((matrix / matrix.diagonal().max())[None])


@pytest.mark.parametrize(("least", "jitter"), [(0.2, 1e-8), (-3e-8, 1e-7), (-3e-6, 1e-5), (-3e-5, 1e-4)])
def test_a_covariance_that_is_hardly_one_gets_as_little_jitter_as_it_needs(least, jitter):
    matrix = covariance(least)
    expected = torch.linalg.cholesky(matrix + jitter * matrix.amax() * torch.eye(12, dtype=torch.float64))
    assert torch.equal(_root(matrix), expected)


@pytest.mark.parametrize("least", [-3e-3, np.nan])
def test_a_covariance_that_is_none_is_an_error_that_names_the_kernel(least):
    with pytest.raises(FitError, match=r"covariance of 12 places is not positive definite.*another model\.kernel"):
        _root(covariance(least))


def test_waves_too_short_for_the_precision_of_numbers_are_one_clear_error():
    module = build("periodic", 2, 1)
    module.base_kernel.raw_period_length.data[:] = -30.0
    places = torch.tensor(np.random.default_rng(0).standard_normal((60, 2)))
    with pytest.raises(FitError, match=r"another model\.kernel"):
        draw_prior(module.requires_grad_(False), places, 3, 20, np.random.default_rng(1))
