from itertools import product

import numpy as np
import pytest
from numpy.polynomial.hermite_e import hermegauss

from twbal.policies.rbf import RbfPolicy
from twbal.policies.rbf_moments import Network, activation_adjoint, activation_moments
from twbal.policies.squash import compensation_of

PLAIN = compensation_of(0.0)

UNITS = np.array([0.1, 2.0, 20.0, 1.0, 5.0])
CASES = pytest.mark.parametrize(("seed", "D", "width"), [(0, 1, 0.4), (1, 2, 1.0), (2, 3, 0.2), (3, 5, 2.0)])


def network(seed, D, N=12):
    """Centres, weights, lengths and gain."""
    rng = np.random.default_rng(seed)
    units = UNITS[:D]
    lengths = units * rng.uniform(0.8, 2.0, D)
    return rng.standard_normal((N, D)) * units, rng.standard_normal(N), lengths, rng.standard_normal(D) / units


def random_input(seed, D, width):
    rng = np.random.default_rng(100 + seed)
    root = UNITS[:D, None] * (rng.standard_normal((D, D)) / np.sqrt(D) + 0.3 * np.eye(D)) * width
    return rng.standard_normal(D) * UNITS[:D], root @ root.T


def activation(parts, x):
    centres, weights, lengths, gain = parts
    return RbfPolicy(("tilt",) * len(gain), centres, weights, lengths, gain, 1.0).activation(x)


@pytest.mark.parametrize(("D", "nodes"), [(1, 150), (2, 60)])
@pytest.mark.parametrize("width", [0.01, 0.3, 2.0])
def test_moments_equal_quadrature(D, nodes, width):
    parts = network(4, D)
    m, S = random_input(5, D, width)
    z, w = hermegauss(nodes)
    z, w = np.array(list(product(z, repeat=D))), np.prod(list(product(w / w.sum(), repeat=D)), axis=1)
    root = np.linalg.cholesky(S)
    a = activation(parts, m + z @ root.T)
    found = activation_moments(Network(*parts, 1.0, PLAIN, 0.0), m, S)
    assert found.mean == pytest.approx(w @ a, rel=1e-9)
    assert found.variance == pytest.approx(w @ (a - w @ a) ** 2, rel=1e-8)
    np.testing.assert_allclose(S @ found.slope, w @ ((z @ root.T) * (a - w @ a)[:, None]), rtol=1e-8)


@CASES
def test_moments_lie_within_4_standard_errors_of_samples(seed, D, width):
    parts = network(seed, D)
    m, S = random_input(seed, D, width)
    count, rng = 200_000, np.random.default_rng(seed)
    x = m + rng.standard_normal((count, D)) @ np.linalg.cholesky(S).T
    a, found = activation(parts, x), activation_moments(Network(*parts, 1.0, PLAIN, 0.0), m, S)
    for values, expected in [
        (a, found.mean),
        ((a - found.mean) ** 2, found.variance),
        *(((x - m)[:, k] * (a - found.mean), (S @ found.slope)[k]) for k in range(D)),
    ]:
        assert abs(values.mean() - expected) < 4 * values.std() / np.sqrt(count)


def test_no_covariance_gives_the_activation_and_its_slope():
    parts = network(0, 3)
    m = random_input(0, 3, 1.0)[0]
    found = activation_moments(Network(*parts, 1.0, PLAIN, 0.0), m, np.zeros((3, 3)))
    steps = 1e-6 * np.diag(UNITS[:3])
    numeric = [(activation(parts, m + e) - activation(parts, m - e)) / (2 * e.sum()) for e in steps]
    assert found.mean == pytest.approx(activation(parts, m), rel=1e-12)
    np.testing.assert_allclose(found.slope, numeric, rtol=1e-6)
    assert found.variance == pytest.approx(0.0, abs=1e-14)


@CASES
def test_the_way_back_equals_finite_differences(seed, D, width):
    rng = np.random.default_rng(seed)
    parts = network(seed, D)
    m, S = random_input(seed, D, width)
    by_mean, by_variance = rng.standard_normal(2)
    by_slope = rng.standard_normal(D) * UNITS[:D]

    def scalar(centres, weights, lengths, gain, mean, covariance):
        found = activation_moments(Network(centres, weights, lengths, gain, 1.0, PLAIN, 0.0), mean, covariance)
        return by_mean * found.mean + by_slope @ found.slope + by_variance * found.variance

    arguments = (*parts, m, S)
    back = activation_adjoint(Network(*parts, 1.0, PLAIN, 0.0), m, S, by_mean, by_slope, by_variance)
    by_argument = (back.centres, back.weights, back.lengths, back.gain, back.mean, back.covariance)
    sizes = (UNITS[:D], 1.0, UNITS[:D], 1.0 / UNITS[:D], UNITS[:D], np.sqrt(np.outer(np.diag(S), np.diag(S))))
    for place, (ours, size) in enumerate(zip(by_argument, sizes, strict=True)):
        for _ in range(6):  # random directions test all entries at once
            direction = rng.standard_normal(ours.shape) * size
            if place == 5:
                direction = 0.1 * (direction + direction.T)
            ends = [
                scalar(*(x + h * direction if k == place else x for k, x in enumerate(arguments)))
                for h in (2e-3, 1e-3, -1e-3, -2e-3)
            ]
            numeric = np.dot([-1, 8, -8, 1], ends) / 12e-3
            assert np.sum(ours * direction) == pytest.approx(numeric, rel=1e-6, abs=1e-8)


def test_variances_are_never_negative():
    for seed in range(500):
        rng = np.random.default_rng(seed)
        D = int(rng.integers(1, 6))
        centres, weights, lengths, gain = network(seed, D)
        m, S = random_input(seed, D, 10.0 ** rng.uniform(-6, 2))
        assert activation_moments(Network(centres, 100 * weights, lengths, gain, 1.0, PLAIN, 0.0), m, S).variance >= 0
