"""Moment matching against GPyTorch, Monte Carlo, quadrature and finite differences, by both of its ways."""

from itertools import product

import numpy as np
import pytest
import torch
from gpytorch_models import exact_model
from moment_matching import predict
from numpy.polynomial.hermite_e import hermegauss

from twbal.models.gp import GaussianProcess, condition
from twbal.models.hyperparameters import Hyperparameters
from twbal.models.moments.adjoint import predict_adjoint
from twbal.models.moments.kernel_sum import KernelSum, no_kernels
from twbal.models.moments.truncation import EXACT, Truncation, series

UNITS = np.array([0.1, 2.0, 20.0, 1.0, 5.0, 0.5])  # of up to six inputs
PAIRS = Truncation(degrees=())
SERIES = Truncation(tolerance=0.0, degrees=(6,), fall_back=False)
WAYS = pytest.mark.parametrize("truncation", [PAIRS, Truncation()], ids=["pairs", "series"])
PARTS = pytest.mark.parametrize("parts", ["f", "g", "f+g"])


def random_gp(seed, n, d, outputs, noise=0.1, stretch=1.0):
    """A posterior of random smooth targets at inputs of very different units; its length-scales are near them."""
    rng = np.random.default_rng(seed)
    units = UNITS[:d]
    z = rng.standard_normal((n, d))
    waves = np.sin(z @ rng.standard_normal((d, outputs)) + rng.uniform(0, 6, outputs))
    amplitude = np.array([0.1, 3.0, 1.0])[:outputs]
    targets = amplitude * (waves + noise * rng.standard_normal((n, outputs)))
    lengths = stretch * units * np.exp(rng.uniform(0.0, 1.0, (outputs, d)))
    return condition(z * units, targets, lengths, 2.0 * amplitude**2, (noise * amplitude) ** 2), targets


def kernels(gp: GaussianProcess, uncertain: bool) -> KernelSum:
    variance = gp.variance_matrix if uncertain else np.zeros((gp.outputs, 0, 0))
    return KernelSum(gp.centres, gp.length_scales, gp.signal_variance, gp.weights, variance)


def random_input(seed, d, width):
    """A mean and a full covariance whose standard deviations are `width` of the inputs' units."""
    rng = np.random.default_rng(seed)
    units = UNITS[:d]
    root = units[:, None] * rng.standard_normal((d, d)) * width / np.sqrt(d)
    return units * rng.standard_normal(d), root @ root.T


def chosen(parts, seed, d, outputs, n=(40, 15)):
    """f, g and their sums of kernels as the model has them: f known, g uncertain, either absent."""
    f, g = random_gp(seed, n[0], d, outputs)[0], random_gp(seed + 50, n[1], d, outputs)[0]
    none = no_kernels(outputs, d)
    return (
        f if "f" in parts else None,
        g if "g" in parts else None,
        kernels(f, False) if "f" in parts else none,
        kernels(g, True) if "g" in parts else none,
    )


def point_moments(f, g, x):
    """Mean (m, E) and model variance (m, E) at known inputs."""
    mean = sum(gp.mean(x) for gp in (f, g) if gp)
    return mean, g.predict(x).variance if g else np.zeros_like(mean)


def covariance_of(p, S):
    return p.slope @ S @ p.slope.T + p.rest


@PARTS
@WAYS
def test_zero_input_covariance_gives_gpytorchs_prediction_and_slope(parts, truncation):
    for seed, d in ((0, 4), (1, 1), (2, 6)):
        outputs = 2
        f, g, f_sum, g_sum = chosen(parts, seed, d, outputs)
        m, S = random_input(seed, d, 1.0)[0], np.zeros((d, d))
        p = predict(f_sum, g_sum, m, S, truncation)
        mean, slope, variance = np.zeros(outputs), np.zeros((outputs, d)), np.zeros(outputs)
        for part, gp in ((seed, f), (seed + 50, g)):
            if gp is None:
                continue
            targets = random_gp(part, len(gp.centres), d, outputs)[1]
            hyper = Hyperparameters(gp.length_scales, gp.signal_variance, gp.noise_variance)
            for a in range(outputs):
                at = torch.tensor(m[None, :], requires_grad=True)
                posterior = exact_model(gp.centres, targets[:, a], hyper, a).eval()(at)
                posterior.mean.sum().backward()
                mean[a] += posterior.mean.item()
                slope[a] += at.grad.numpy()[0]
                variance[a] += posterior.variance.item() if gp is g else 0.0
        np.testing.assert_allclose(p.mean, mean, rtol=1e-7, atol=1e-9)
        np.testing.assert_allclose(p.slope, slope, rtol=1e-6, atol=1e-8)
        np.testing.assert_allclose(p.rest, np.diag(variance), rtol=1e-6, atol=1e-9)


def monte_carlo_holds(parts, seed, d, outputs, width, truncation, samples=1_000_000):
    f, g, f_sum, g_sum = chosen(parts, seed, d, outputs, n=(25, 10))
    m, S = random_input(seed, d, width)
    p = predict(f_sum, g_sum, m, S, truncation)
    rng = np.random.default_rng(seed)
    values, vectors = np.linalg.eigh(S)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    x_parts, y_parts = [], []
    for _ in range(20):
        x = m + rng.standard_normal((samples // 20, d)) @ root.T
        mean, variance = point_moments(f, g, x)
        y_parts.append(mean + np.sqrt(variance) * rng.standard_normal(mean.shape))
        x_parts.append(x)
    x, y = np.concatenate(x_parts), np.concatenate(y_parts)
    assert (np.abs(y.mean(0) - p.mean) < 4 * y.std(0) / np.sqrt(samples)).all()
    dx, dy = x - m, y - p.mean
    for a in range(outputs):
        for other, expected in [(dy[:, b], covariance_of(p, S)[a, b]) for b in range(a + 1)] + [
            (dx[:, k], (S @ p.slope.T)[k, a]) for k in range(d)
        ]:
            found = dy[:, a] * other
            assert abs(found.mean() - expected) < 4 * found.std() / np.sqrt(samples)
    return p


@PARTS
def test_moments_lie_within_4_standard_errors_of_a_million_samples(parts):
    assert monte_carlo_holds(parts, 3, 3, 2, 0.1, Truncation()).degree != EXACT


@pytest.mark.slow
@PARTS
@pytest.mark.parametrize(("seed", "d", "width"), [(4, 4, 0.2), (5, 5, 1.0), (6, 2, 3.0), (7, 6, 0.5)])
@WAYS
def test_more_of_them_lie_within_4_standard_errors_of_a_million_samples(parts, seed, d, width, truncation):
    monte_carlo_holds(parts, seed, d, 3, width, truncation)


@PARTS
@WAYS
@pytest.mark.parametrize("width", [0.01, 0.3, 2.0])
def test_in_one_dimension_moments_equal_quadrature(parts, truncation, width):
    nodes, node_weights = hermegauss(180)
    node_weights = node_weights / node_weights.sum()
    for seed in range(4):
        f, g, f_sum, g_sum = chosen(parts, seed, 1, 2)
        m, S = np.array([0.03]), np.array([[(0.1 * width) ** 2]])
        p = predict(f_sum, g_sum, m, S, truncation)
        x = m + np.sqrt(S[0]) * nodes[:, None]
        mean, variance = point_moments(f, g, x)
        expected = node_weights @ mean
        centred = mean - expected
        covariance = np.einsum("i,ia,ib->ab", node_weights, centred, centred) + np.diag(node_weights @ variance)
        scale = np.sqrt(np.diag(covariance))
        np.testing.assert_allclose(p.mean, expected, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(
            covariance_of(p, S) / np.outer(scale, scale), covariance / np.outer(scale, scale), atol=1e-6
        )
        cross = node_weights @ ((x - m) * centred)
        np.testing.assert_allclose((S @ p.slope.T)[0], cross, rtol=1e-8, atol=1e-9 * np.abs(cross).max())


def stencil(function, x, step):
    """Derivative at 0 of function(x + t · step), by five points: the error is of fourth order."""
    far, near = function(x + 2 * step) - function(x - 2 * step), function(x + step) - function(x - step)
    return (8 * near - far) / 12


@PARTS
@pytest.mark.parametrize("truncation", [PAIRS, SERIES], ids=["pairs", "series"])
@pytest.mark.parametrize(("seed", "d", "width"), [(0, 1, 0.5), (1, 4, 0.3), (2, 3, 1.5), (3, 5, 0.1)])
def test_gradients_equal_finite_differences(parts, truncation, seed, d, width):
    rng = np.random.default_rng(seed)
    _, _, f, g = chosen(parts, seed, d, 2)
    m, S = random_input(seed, d, width)
    units = UNITS[:d]
    S += np.diag((0.3 * width * units) ** 2)  # differences by S need room to both sides
    by_value, by_slope = rng.standard_normal(2), rng.standard_normal((2, d)) * units
    by_rest = rng.standard_normal((2, 2))
    by_rest = by_rest + by_rest.T

    def scalar(mean, covariance):
        p = predict(f, g, mean, covariance, truncation)
        return by_value @ p.mean + np.sum(by_slope * p.slope) + np.sum(by_rest * p.rest)

    by_mean, by_covariance = predict_adjoint(
        predict(f, g, m, S, truncation), S, series(truncation, len(m)).indices, by_value, by_slope, by_rest
    )
    steps = 1e-2 * units
    numeric = [stencil(lambda x: scalar(x, S), m, e) for e in np.diag(steps)]
    np.testing.assert_allclose(by_mean * steps, numeric, rtol=1e-6, atol=1e-6 * np.abs(numeric).max())
    small = 1e-2 * np.sqrt(np.outer(np.diag(S), np.diag(S)))
    numeric, ours = [], []
    for k, l in product(range(d), repeat=2):
        step = np.zeros((d, d))
        step[k, l] += small[k, l]
        step[l, k] += small[k, l]
        numeric.append(stencil(lambda x: scalar(m, x), S, step))
        ours.append(np.sum(by_covariance * step))
    np.testing.assert_allclose(ours, numeric, rtol=1e-6, atol=1e-6 * np.abs(numeric).max())


def random_draw(seed, hard):
    """Sums of kernels and an input, of random sizes and widths; hard ones have a signal-to-noise of 1000."""
    rng = np.random.default_rng(seed)
    d, outputs, n = int(rng.integers(1, 6)), int(rng.integers(1, 4)), int(rng.integers(2, 25))
    noise = 1e-3 if hard else 10.0 ** rng.uniform(-2, 0)
    stretch = 10.0 ** rng.uniform(0, 1.5) if hard else 1.0
    f, g = (random_gp(seed + k, n, d, outputs, noise, stretch)[0] for k in (0, 10_000))
    which = rng.integers(3)
    f_sum = no_kernels(outputs, d) if which == 0 else kernels(f, False)
    g_sum = no_kernels(outputs, d) if which == 1 else kernels(g, True)
    return f_sum, g_sum, *random_input(seed, d, 10.0 ** rng.uniform(-3, 1))


def test_the_series_equals_pairs_where_it_says_that_it_converged():
    converged = 0
    for seed in range(400):
        f, g, m, S = random_draw(seed, hard=False)
        series = predict(f, g, m, S, Truncation())
        if series.degree == EXACT:
            continue
        converged += 1
        pairs = predict(f, g, m, S, PAIRS)
        scale = np.sqrt(np.diag(covariance_of(pairs, S)))
        relative = (covariance_of(series, S) - covariance_of(pairs, S)) / np.outer(scale, scale)
        # Narrow inputs leave the pairs' own sum few digits: it is a difference of numbers as large as α².
        floor = 1e-13 * np.outer(f.signal_variance + g.signal_variance, 1.0 / scale**2)
        assert (np.abs(relative) < 1e-6 + floor.max()).all(), seed
        np.testing.assert_allclose(series.mean, pairs.mean, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(series.slope, pairs.slope, rtol=1e-9, atol=1e-12)
    assert converged > 100


@pytest.mark.parametrize(
    ("truncation", "least"),
    [(Truncation(), -1e-14), (SERIES, -1e-14), (PAIRS, -1e-9)],  # of the signal variance: pairs alone lose digits
    ids=["series or pairs", "cut series", "pairs"],
)
@pytest.mark.parametrize("draws", [200, pytest.param(1000, marks=pytest.mark.slow)])
def test_covariances_of_many_draws_are_positive_semi_definite(truncation, least, draws):
    degrees = set()
    for seed in range(draws):
        f, g, m, S = random_draw(seed, hard=seed % 2 == 0)
        p = predict(f, g, m, S, truncation)
        degrees.add(p.degree)
        units = np.sqrt(f.signal_variance + g.signal_variance)
        for covariance in (p.rest, covariance_of(p, S)):
            relative = covariance / np.outer(units, units)
            np.testing.assert_allclose(relative, relative.T, atol=1e-15 * max(1.0, np.abs(relative).max()))
            assert np.linalg.eigvalsh(relative).min() > least * max(1.0, np.abs(relative).max()), seed
    assert degrees == {EXACT, *truncation.degrees} - (set() if truncation.fall_back else {EXACT})


def test_a_cut_series_only_leaves_variance_out_and_says_so():
    for seed in range(100):
        f, g, m, S = random_draw(seed, hard=False)
        pairs = np.diag(predict(f, g, m, S, PAIRS).rest)
        cut = [predict(f, g, m, S, Truncation(0.0, (p,), fall_back=False)) for p in (2, 4, 6)]
        courses = np.array([np.diag(p.rest) for p in cut] + [pairs])
        assert (np.diff(courses, axis=0) > -1e-10 * (f.signal_variance + g.signal_variance)).all(), seed
        assert all(p.degree in (2, 4, 6) and p.truncated >= 0 for p in cut)


def test_the_degree_rises_until_the_tolerance_holds():
    f, g = (kernels(random_gp(k, 30, 3, 2)[0], False) for k in (0, 1))
    m, S = random_input(0, 3, 0.15)
    found = [predict(f, g, m, S, Truncation(tolerance)) for tolerance in (1e-1, 1e-3, 1e-5, 1e-18)]
    assert [p.degree for p in found] == [*sorted(p.degree for p in found[:-1]), EXACT]
    assert len({p.degree for p in found}) > 2
    assert all(p.truncated <= t for p, t in zip(found, (1e-1, 1e-3, 1e-5, 1e-12), strict=True))
    assert predict(f, g, m, S, Truncation(1e-1), start_degree=6).degree == 6


def test_an_output_that_is_added_to_what_varies_more_needs_fewer_degrees():
    f, g = (kernels(random_gp(k, 30, 3, 2)[0], False) for k in (0, 1))
    m, S = random_input(0, 3, 0.15)
    alone = predict(f, g, m, S, Truncation(1e-5))
    variances = np.diag(alone.rest + alone.slope @ S @ alone.slope.T)
    beside = predict(f, g, m, S, Truncation(1e-5), reference=1e3 * variances)
    assert beside.degree < alone.degree
    exact = np.diag(predict(f, g, m, S, PAIRS).rest)
    assert (np.abs(np.diag(beside.rest) - exact) < 1e-5 * 1e3 * variances).all()


def test_a_singular_input_covariance_moves_along_its_own_directions_only():
    f, g, f_sum, g_sum = chosen("f+g", 8, 3, 2)
    m, direction = random_input(8, 3, 1.0)[0], np.array([0.02, 0.3, 1.0])
    p = predict(f_sum, g_sum, m, np.outer(direction, direction), PAIRS)
    nodes, node_weights = hermegauss(100)
    node_weights = node_weights / node_weights.sum()
    mean, variance = point_moments(f, g, m + nodes[:, None] * direction)
    np.testing.assert_allclose(p.mean, node_weights @ mean, rtol=1e-9)
    centred = mean - p.mean
    expected = np.einsum("i,ia,ib->ab", node_weights, centred, centred) + np.diag(node_weights @ variance)
    np.testing.assert_allclose(covariance_of(p, np.outer(direction, direction)), expected, rtol=1e-7, atol=1e-10)


def test_two_functions_predict_as_the_one_that_holds_the_basis_functions_of_both():
    f, g = (kernels(random_gp(k, 12, 3, 2)[0], False) for k in (0, 1))
    g = g._replace(length_scales=f.length_scales, signal_variance=f.signal_variance)
    both = f._replace(inputs=np.vstack([f.inputs, g.inputs]), weights=np.hstack([f.weights, g.weights]))
    m, S = random_input(2, 3, 0.5)
    one, other = predict(f, g, m, S, PAIRS), predict(both, no_kernels(2, 3), m, S, PAIRS)
    np.testing.assert_allclose(one.mean, other.mean, rtol=1e-10)
    np.testing.assert_allclose(one.rest, other.rest, rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(one.slope, other.slope, rtol=1e-10)


def test_inputs_however_wide_and_far_give_finite_moments():
    for seed in range(300):
        f, g, m, S = random_draw(seed, hard=True)
        wider = 10.0 ** np.random.default_rng(seed).uniform(0, 8)
        p = predict(f, g, m * wider**0.5, S * wider, Truncation())
        found = (p.mean, p.slope, p.rest, p.exact_by_mean, p.exact_by_covariance)
        assert all(np.isfinite(values).all() for values in found), seed
