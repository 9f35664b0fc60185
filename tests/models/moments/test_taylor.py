import numpy as np
import pytest
from numpy.polynomial.hermite_e import hermegauss

from twbal.models.moments.kernel_sum import KernelSum, no_kernels
from twbal.models.moments.multi_index import multi_indices
from twbal.models.moments.taylor import add_derivatives


def random_sum(seed, d, n=11, outputs=2):  # n is no multiple of the lanes
    rng = np.random.default_rng(seed)
    lengths, nothing = rng.uniform(0.8, 2.0, (outputs, d)), np.zeros((outputs, 0, 0))
    weights = rng.standard_normal((outputs, n))
    return KernelSum(rng.standard_normal((n, d)), lengths, rng.uniform(0.5, 2.0, outputs), weights, nothing)


def values(kernels, x):
    """h(x), (m, E)."""
    gaps = (x[:, None, None, :] - kernels.inputs) / kernels.length_scales[:, None, :]  # (m, E, n, d)
    basis = np.exp(-0.5 * (gaps**2).sum(axis=-1))
    return np.einsum("man,an,a->ma", basis, kernels.weights, kernels.signal_variance)


def derivatives(kernels, m, S, basis, degree):
    indices = multi_indices(len(m), degree)
    T = np.zeros((len(kernels.weights), len(indices.parent)))
    add_derivatives(T, kernels, m, S, basis, indices)
    return T, indices


@pytest.mark.parametrize("d", [1, 3])
def test_each_derivative_is_that_of_the_one_below_it(d):
    rng = np.random.default_rng(0)
    kernels, m, basis, root = random_sum(1, d), rng.standard_normal(d), np.eye(d), 0.5 * rng.standard_normal((d, d))
    S = root @ root.T
    T, indices = derivatives(kernels, m, S, basis, 6)
    for k in range(d):
        step = 1e-4 * basis[:, k]
        above, below = (derivatives(kernels, m + s, S, basis, 5)[0] for s in (step, -step))
        up = indices.up[: above.shape[1], k]
        np.testing.assert_allclose(T[:, up], (above - below) / 2e-4, rtol=1e-6, atol=1e-5)


def test_derivatives_along_other_axes_are_the_same_function():
    rng = np.random.default_rng(0)
    kernels, m, basis, S = random_sum(1, 3), rng.standard_normal(3), rng.standard_normal((3, 3)), 0.1 * np.eye(3)
    here, indices = derivatives(kernels, m, S, basis, 14)
    t = np.array([0.05, -0.1, 0.08])
    powers = np.prod(t**indices.powers, axis=1) / indices.factorial
    moved = derivatives(kernels, m + basis @ t, S, np.eye(3), 0)[0]
    np.testing.assert_allclose(here @ powers, moved[:, 0], rtol=1e-9)


def test_the_smoothed_value_is_the_average_over_the_input():
    kernels, m, S = random_sum(2, 1), np.array([0.3]), np.array([[0.6]])
    nodes, weights = hermegauss(80)
    expected = weights @ values(kernels, m + np.sqrt(S[0]) * nodes[:, None]) / weights.sum()
    np.testing.assert_allclose(derivatives(kernels, m, S, np.eye(1), 0)[0][:, 0], expected, rtol=1e-12)


def test_no_kernels_add_nothing():
    T, _ = derivatives(no_kernels(2, 3), np.zeros(3), np.eye(3), np.eye(3), 4)
    assert not T.any()
