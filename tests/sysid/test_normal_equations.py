"""Normal equations that leave something open, against dense least squares."""

import numpy as np
import pytest

from twbal.sysid.normal_equations import inverse_of, solve_normal
from twbal.sysid.smooth_regression import projected


def slopes(rng):
    """(60, 4), of sizes far apart."""
    return rng.normal(size=(60, 4)) * [1e-6, 1.0, 1e5, 30.0]


@pytest.mark.parametrize("columns", [(), (3,)])
def test_what_the_data_tell_is_found_as_by_least_squares(columns):
    rng = np.random.default_rng(0)
    J = slopes(rng)
    right = J.T @ rng.normal(size=(60, *columns))
    np.testing.assert_allclose(solve_normal(J.T @ J, right), np.linalg.solve(J.T @ J, right), rtol=1e-6)


def test_a_value_on_which_nothing_bears_stays_and_two_that_do_the_same_share():
    rng = np.random.default_rng(1)
    J, y = slopes(rng), rng.normal(size=60)
    without = np.linalg.lstsq(J, y, rcond=None)[0]
    more = np.hstack([J, np.zeros((60, 1)), 1e4 * J[:, 1:2]])
    found = solve_normal(more.T @ more, more.T @ y)
    assert found[4] == 0.0
    np.testing.assert_allclose(found[[0, 2, 3]], without[[0, 2, 3]], rtol=1e-6)
    assert found[1] == pytest.approx(0.5 * without[1], rel=1e-4)
    assert 1e4 * found[5] == pytest.approx(0.5 * without[1], rel=1e-4)


def test_nuisance_that_cannot_be_told_apart_is_taken_out_once():
    """Singular normal equations once ended a diagnosis."""
    rng = np.random.default_rng(2)
    A, J, y = rng.normal(size=(60, 5)), slopes(rng), rng.normal(size=60)
    idle = np.hstack([J, np.zeros((60, 1)), J[:, :1] + J[:, 1:2]])
    clean, found = (projected(A, y, each, np.zeros(each.shape[1])) for each in (J, idle))
    np.testing.assert_allclose(found.M, clean.M, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(found.b, clean.b, rtol=1e-6, atol=1e-6)
    assert found.power == pytest.approx(clean.power, rel=1e-6)


def test_an_inverse_is_that_of_the_matrix_unless_there_is_none():
    J = slopes(np.random.default_rng(3))
    H = J.T @ J
    assert (inverse_of(H) == np.linalg.inv(H)).all()
    twice = np.array([[1.0, 1.0], [1.0, 1.0]])  # two values that do exactly the same
    pull = np.array([3.0, 3.0])
    assert inverse_of(twice) @ pull == pytest.approx([1.5, 1.5], rel=1e-6)


def test_the_inverse_of_what_is_singular_but_for_rounding_has_variances():
    """Of slopes that are alike in ten digits; their products tell them apart by rounding alone."""
    rng = np.random.default_rng(0)
    for _ in range(200):
        common = 1e8 * rng.standard_normal(50)
        J = common[:, None] * (1.0 + 1e-10 * rng.standard_normal((50, 4)))
        found = inverse_of(J.T @ J + 1e-6 * np.eye(4))
        assert (np.diag(found) > 0.0).all()
