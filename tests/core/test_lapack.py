"""LAPACK's Cholesky routines, called without Python's lock."""

import numpy as np
import pytest
import scipy.linalg

from twbal.core.errors import FitError
from twbal.core.gaussian import Array
from twbal.core.lapack import factor, invert


def _positive_definite(n: int) -> Array:
    root = np.random.default_rng(n).standard_normal((n, n))
    return np.asfortranarray(root @ root.T + n * np.eye(n))


@pytest.mark.parametrize("n", [1, 2, 7, 64, 201])
def test_factors_and_inverse_are_scipys_to_the_last_bit(n: int) -> None:
    matrix = _positive_definite(n)
    theirs, _ = scipy.linalg.lapack.dpotrf(matrix, lower=1, clean=0)

    assert factor(matrix)
    np.testing.assert_array_equal(np.tril(matrix), np.tril(theirs))
    invert(matrix)
    np.testing.assert_array_equal(np.tril(matrix), np.tril(scipy.linalg.lapack.dpotri(theirs, lower=1)[0]))


def test_inverse_times_matrix_is_the_identity() -> None:
    matrix = _positive_definite(30)
    found = matrix.copy(order="F")
    assert factor(found)
    invert(found)

    lower = np.tril(found)
    np.testing.assert_allclose((lower + np.tril(found, -1).T) @ matrix, np.eye(30), atol=1e-12)


def test_a_matrix_that_is_not_positive_definite_has_no_factor() -> None:
    assert not factor(np.asfortranarray([[1.0, 2.0], [2.0, 1.0]]))


@pytest.mark.parametrize(
    "matrix",
    [np.ones((2, 3), order="F"), np.eye(3, dtype=np.float32, order="F"), _positive_definite(3).copy(order="C")],
    ids=["not square", "float32", "row-major"],
)
def test_what_lapack_would_misread_is_refused(matrix: Array) -> None:
    with pytest.raises(FitError, match="column-major"):
        factor(matrix)
