import numpy as np
import pytest
from numpy.polynomial.hermite_e import hermegauss

from twbal.models.moments.kernel_sum import KernelSum
from twbal.models.moments.pairwise import own_moment, pair_moment

N, M, S = 41, np.array([-0.2]), np.array([[0.7]])  # points: more than are summed at once, and no multiple of that
NODES, WEIGHTS = hermegauss(120)
WEIGHTS = WEIGHTS / WEIGHTS.sum()


def random_sum(seed):
    rng = np.random.default_rng(seed)
    lengths, signal = rng.uniform(0.8, 2.0, (2, 1)), rng.uniform(0.5, 2.0, 2)
    return KernelSum(rng.standard_normal((N, 1)), lengths, signal, rng.standard_normal((2, N)), np.zeros((2, 0, 0)))


def basis(kernels, a, m=M):
    """k_i at the nodes of the quadrature, (nodes, N)."""
    x = m + np.sqrt(S[0]) * NODES[:, None]
    return kernels.signal_variance[a] * np.exp(-0.5 * ((x - kernels.inputs[:, 0]) / kernels.length_scales[a]) ** 2)


def test_a_pair_moment_is_the_average_of_the_product():
    first, second = random_sum(3), random_sum(4)
    h_a, h_b = basis(first, 0) @ first.weights[0], basis(second, 1) @ second.weights[1]
    centred, total, _, _ = pair_moment(0, first, 1, second, M, S)
    assert total == pytest.approx(WEIGHTS @ (h_a * h_b), rel=1e-10)
    assert centred == pytest.approx(WEIGHTS @ (h_a * h_b) - (WEIGHTS @ h_a) * (WEIGHTS @ h_b), rel=1e-8)


@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("linked", [False, True])
def test_an_own_moment_is_that_of_one_function_with_itself(weighted, linked):
    kernels, rng = random_sum(5), np.random.default_rng(0)
    weights = kernels.weights[1] if weighted else np.zeros(0)
    links = rng.standard_normal((N, N)) if linked else np.zeros((0, 0))
    links = np.ascontiguousarray(links + links.T)

    def averages(m):
        k = basis(kernels, 1, m)
        h = k @ weights if weighted else np.zeros(len(NODES))
        link = np.einsum("mi,ij,mj->m", k, links, k) if linked else np.zeros(len(NODES))
        return WEIGHTS @ h, WEIGHTS @ h**2, WEIGHTS @ link

    mean, square, link = averages(M)
    centred, linked_sum, by_mean, by_covariance = own_moment(1, kernels, weights, links, M, S)
    assert centred == pytest.approx(square - mean**2, rel=1e-8)
    assert linked_sum == pytest.approx(link, rel=1e-9, abs=1e-12)
    step = 1e-3
    values = [averages(M + k * step) for k in (-2, -1, 0, 1, 2)]
    differences = np.array([square - link for _, square, link in values])
    assert by_mean[0] == pytest.approx(np.dot([1, -8, 0, 8, -1], differences) / (12 * step), rel=1e-6, abs=1e-9)
    curvature = np.dot([-1, 16, -30, 16, -1], differences) / (12 * step**2)
    assert by_covariance[0, 0] == pytest.approx(0.5 * curvature, rel=1e-5, abs=1e-6)  # the heat equation
