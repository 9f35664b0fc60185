"""Solves the normal equations of a linear least-squares fit, also where they are singular."""

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from twbal.core.gaussian import Array

_RIDGE = 1e-9  # of the diagonal: far above rounding, far below what the data say


def solve_normal(H: Array, right: Array) -> Array:
    """x with H x = `right`, for H that is positive semi-definite but for rounding.

    The data may not bear on a value at all, or only on the sum of two. A small ridge decides there (A. E. Hoerl,
    R. W. Kennard: Ridge regression, Technometrics 12 (1), 1970, 55-67): a value on which nothing bears stays 0, and two
    that do the same share.

    Args:
        H: (P, P), JᵀJ and the precision of a prior.
        right: (P,) or (P, m).
    """
    diagonal = np.diag(H)
    scale = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    factor = cho_factor(H / np.outer(scale, scale) + _RIDGE * np.eye(len(H)))
    return np.asarray((cho_solve(factor, (right.T / scale).T).T / scale).T)


def inverse_of(H: Array) -> Array:
    """The inverse of a matrix as of `solve_normal`, (P, P); the ridge decides only where it is singular.

    Two free values that do exactly the same make it so, as the torques of Coulomb and Stribeck friction in one set. By
    rounding it may then have an inverse whose diagonal is not positive, which no variances can be.
    """
    try:
        found = np.asarray(np.linalg.inv(H))
    except np.linalg.LinAlgError:
        return solve_normal(H, np.eye(len(H)))
    return found if (np.diag(found) > 0.0).all() else solve_normal(H, np.eye(len(H)))
