import numpy as np

from twbal.core.gaussian import Gaussian

ROOT = np.array([[1.0, 0.0, 0.0], [0.5, 2.0, 0.0], [-1.0, 0.3, 0.2]])


def test_samples_have_the_mean_and_the_covariance():
    given = Gaussian(np.array([1.0, -2.0, 3.0]), ROOT @ ROOT.T)
    drawn = given.sample(100_000, np.random.default_rng(0))
    count, gaps = len(drawn), drawn - given.mean
    assert (np.abs(gaps.mean(0)) < 4 * given.sd / np.sqrt(count)).all()
    products = gaps[:, :, None] * gaps[:, None, :]
    assert (np.abs(products.mean(0) - given.covariance) < 4 * products.std(0) / np.sqrt(count)).all()


def test_a_singular_covariance_is_sampled_within_its_own_directions():
    direction = np.array([1.0, -2.0, 0.0])
    given = Gaussian(np.array([0.0, 1.0, 5.0]), np.outer(direction, direction))
    drawn = given.sample(50, np.random.default_rng(0)) - given.mean
    np.testing.assert_allclose(drawn @ [2.0, 1.0, 0.0], 0.0, atol=1e-7)
    np.testing.assert_allclose(drawn[:, 2], 0.0, atol=1e-7)
    assert drawn[:, 0].std() > 0.5


def test_a_known_state_is_drawn_as_it_is():
    given = Gaussian(np.array([1.0, 2.0]), np.zeros((2, 2)))
    assert np.array_equal(given.sample(3, np.random.default_rng(0)), np.tile(given.mean, (3, 1)))


def test_sd_is_the_root_of_the_diagonal_and_never_nan():
    assert Gaussian(np.zeros(2), np.diag([4.0, -1e-18])).sd.tolist() == [2.0, 0.0]
