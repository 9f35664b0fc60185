import numpy as np
import pytest

from twbal.models.function_samples import FunctionSamples
from twbal.models.gp import GaussianProcess, condition
from twbal.models.hyperparameters import Hyperparameters
from twbal.models.sparse import choose_inducing, condition_sparse

COUNT = 2000


@pytest.fixture(scope="module")
def gp():
    rng = np.random.default_rng(0)
    inputs = rng.standard_normal((15, 2)) * [1.0, 10.0]
    targets = np.column_stack([np.sin(inputs[:, 0]), 5.0 * np.tanh(inputs[:, 1] / 10)])
    lengths = np.array([[0.8, 15.0], [2.0, 8.0]])
    return condition(inputs, targets, lengths, np.array([1.0, 20.0]), np.array([0.01, 2.0]))


@pytest.fixture(scope="module")
def samples(gp):
    return FunctionSamples.draw(gp, COUNT, features=1500, rng=np.random.default_rng(1))


def places(gp):
    """Among the data, at a sample, between them, and where there are none."""
    return np.array([[0.0, 0.0], gp.centres[3], [-1.5, 8.0], [4.0, -30.0], [50.0, 500.0]])


def test_mean_and_variance_over_many_functions_are_the_posteriors(gp, samples):
    expected = gp.predict(places(gp))
    for place, mean, variance in zip(places(gp), *expected, strict=True):
        values = samples(np.tile(place, (COUNT, 1)))
        assert (np.abs(values.mean(0) - mean) < 4 * np.sqrt(variance / COUNT)).all()
        np.testing.assert_allclose(values.var(0), variance, rtol=4 * np.sqrt(2 / COUNT) + 0.05)  # and of the features


def test_values_of_one_function_at_two_inputs_vary_together_as_in_the_posterior(gp, samples):
    x, y = np.array([[0.3, 2.0]]), np.array([[0.6, 4.0]])
    ours = [samples(np.tile(z, (COUNT, 1))) for z in (x, y)]
    for a in range(2):
        prior = condition(y, np.zeros((1, 2)), gp.length_scales, gp.signal_variance, gp.noise_variance).covariance(x, a)
        posterior = prior - gp.covariance(x, a) @ gp.variance_matrix[a] @ gp.covariance(y, a).T
        sd = [values[:, a].std() for values in ours]
        correlation = posterior[0, 0] / np.sqrt(np.prod([gp.predict(z).variance[0, a] for z in (x, y)]))
        found = np.corrcoef(ours[0][:, a], ours[1][:, a])[0, 1]
        assert found == pytest.approx(correlation, abs=0.06)
        assert min(sd) > 0


def test_a_function_stays_the_same_from_call_to_call_and_depends_on_its_own_input_alone(samples):
    inputs = np.random.default_rng(2).standard_normal((COUNT, 2))
    values = samples(inputs)
    assert np.array_equal(samples(inputs), values)
    inputs[1:] += 1.0
    np.testing.assert_allclose(samples(inputs)[0], values[0], rtol=1e-12)


def test_functions_repeat_by_their_seed(gp):
    one, other = (FunctionSamples.draw(gp, 3, 50, np.random.default_rng(7)) for _ in range(2))
    assert np.array_equal(one(places(gp)[:3]), other(places(gp)[:3]))


@pytest.fixture(scope="module")
def sparse():
    """A sparse GP whose 25 inducing inputs stand for 300 samples with little noise."""
    rng = np.random.default_rng(4)
    inputs = rng.uniform(-2, 2, (300, 2))
    targets = np.sin(2 * inputs) + 0.03 * rng.standard_normal((300, 2))
    hyper = Hyperparameters(np.array([[0.9, 2.0], [1.5, 0.8]]), np.array([1.0, 2.0]), np.array([1e-3, 1e-2]))
    return condition_sparse(inputs, targets, choose_inducing(inputs, hyper, 25, 0.0), hyper).gp


def test_functions_of_a_sparse_gp_have_its_mean_and_variance(sparse):
    drawn = FunctionSamples.draw(sparse, COUNT, features=1500, rng=np.random.default_rng(1))
    for place in np.array([[0.0, 0.0], [1.0, -1.5], [1.9, 1.9], [3.0, 0.0], [20.0, 20.0]]):
        mean, variance = (values[0] for values in sparse.predict(place[None]))
        values = drawn(np.tile(place, (COUNT, 1)))
        assert (np.abs(values.mean(0) - mean) < 4 * np.sqrt(variance / COUNT) + 2e-3).all()
        # The features' own error adds to a variance that is a thousandth of the prior's.
        np.testing.assert_allclose(values.var(0), variance, rtol=4 * np.sqrt(2 / COUNT) + 0.05, atol=1e-3)


def test_the_root_of_a_sparse_gp_is_that_of_its_definition(sparse):
    for a in range(2):
        prior, W, root = sparse.covariance(sparse.centres, a), sparse.variance_matrix[a], sparse.sample_root[a]
        defined = W - W @ prior @ W
        np.testing.assert_allclose(prior @ root @ root.T @ prior, prior @ defined @ prior, atol=1e-5)


def test_a_sparse_gp_survives_its_payload(sparse):
    again = GaussianProcess.from_payload(sparse.to_payload())
    one, other = (FunctionSamples.draw(gp, 3, 50, np.random.default_rng(7)) for gp in (sparse, again))
    assert np.array_equal(one.corrections, other.corrections)
