import numpy as np
import pytest

from twbal.core.errors import CheckpointError, FitError
from twbal.models.gp import GaussianProcess, condition


@pytest.fixture
def gp():
    rng = np.random.default_rng(0)
    inputs, targets = rng.standard_normal((12, 3)), rng.standard_normal((12, 2))
    return condition(inputs, targets, rng.uniform(0.5, 2, (2, 3)), np.array([1.0, 3.0]), np.array([0.1, 0.01]))


def test_one_sample_gives_the_closed_form():
    gp = condition(np.array([[1.0]]), np.array([[2.0]]), np.array([[0.5]]), np.array([3.0]), np.array([0.25]))
    k = 3.0 * np.exp(-0.5 * (1.4 - 1.0) ** 2 / 0.5**2)
    mean, variance = gp.predict(np.array([[1.4]]))
    assert mean[0, 0] == pytest.approx(k * 2.0 / 3.25)
    assert variance[0, 0] == pytest.approx(3.0 - k**2 / 3.25)


def test_far_away_the_prior_returns(gp):
    mean, variance = gp.predict(np.full((1, 3), 1e3))
    np.testing.assert_allclose(mean, 0.0, atol=1e-12)
    np.testing.assert_allclose(variance[0], gp.signal_variance)


def test_mean_alone_equals_the_prediction(gp):
    at = np.random.default_rng(1).standard_normal((7, 3))
    np.testing.assert_allclose(gp.mean(at), gp.predict(at).mean, rtol=1e-12)


def test_slope_equals_finite_differences(gp):
    point, h = np.array([0.3, -0.2, 0.5]), 1e-6
    numeric = [(gp.mean(point + h * e) - gp.mean(point - h * e))[0] / (2 * h) for e in np.eye(3)]
    np.testing.assert_allclose(gp.slope(point)[0], np.transpose(numeric), atol=1e-8)


def test_digits_survive_inputs_far_from_zero(gp):
    shift = 1e6
    moved = GaussianProcess(**{**gp.to_payload(), "centres": gp.centres + shift})
    at = np.random.default_rng(1).standard_normal((7, 3))
    np.testing.assert_allclose(moved.predict(at + shift).mean, gp.predict(at).mean, atol=1e-6)


def test_payload_round_trip_is_exact(gp):
    again = GaussianProcess.from_payload(gp.to_payload())
    for name, values in gp.to_payload().items():
        assert np.array_equal(getattr(again, name), values)


def test_an_incomplete_payload_names_what_is_missing(gp):
    payload = gp.to_payload()
    del payload["weights"]
    with pytest.raises(CheckpointError, match="has no 'weights'"):
        GaussianProcess.from_payload(payload)


def test_arrays_that_do_not_fit_together_are_refused(gp):
    with pytest.raises(FitError, match=r"weights of shape \(2, 12\); found \(2, 11\)"):
        GaussianProcess(**{**gp.to_payload(), "weights": gp.weights[:, :-1]})


def test_a_repeated_input_without_noise_is_named(gp):
    inputs = np.zeros((3, 2))
    with pytest.raises(FitError, match="output 0 is not positive definite"):
        condition(inputs, np.ones((3, 1)), np.ones((1, 2)), np.ones(1), np.zeros(1))
