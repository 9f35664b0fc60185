r"""Bayesian linear regression on the weights of a smooth function, beside nuisance parameters that it may mimic.

Whitened errors y = A β - J x + ε, with ε ~ N(0, κ I), the nuisance parameters x ~ N(0, κ Λ⁻¹) and β ~ N(0, σ² S_ℓ). All
that is needed of them is M = Aᵀ P A and b = Aᵀ P y with P = I - J (Λ + JᵀJ)⁻¹ Jᵀ, which takes out what x does as well.
The gain in log evidence over f = 0 is

    ½ bᵀ (M + κ S⁻¹/σ²)⁻¹ b / κ - ½ log det(I + σ² S^½ M S^½ / κ),

at the σ and ℓ where it is largest (evidence maximisation; C. E. Rasmussen, C. K. I. Williams: Gaussian Processes for
Machine Learning, 2006, section 5.4.1). Its distribution without a function is that of b ~ N(0, κ M).
"""

from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.sysid.normal_equations import solve_normal

_SIZES = np.geomspace(1e-2, 1e10, 37)  # of σ², over what makes prior and data weigh the same in the best known weight
_DRAWS = 1000  # of the null, for each function that is tried


class Projected(NamedTuple):
    """What a regression needs to know of errors and of a function's weights.

    Attributes:
        M: (m, m), Aᵀ P A.
        b: (m,), Aᵀ P y.
        power: yᵀ P y.
        shift: (P, m) by which nuisance parameters move with the weights, (Λ + JᵀJ)⁻¹ Jᵀ A.
        moved: (P,) by which they move without: -(Λ + JᵀJ)⁻¹ Jᵀ y.
    """

    M: Array
    b: Array
    power: float
    shift: Array
    moved: Array


class PriorFit(NamedTuple):
    """The best length and size of a function.

    Attributes:
        gain: in log evidence over no function [nats].
        prior: (m,) variances of the weights.
    """

    gain: float
    prior: Array


class Weights(NamedTuple):
    """The posterior of a function's weights.

    Attributes:
        mean: (m,).
        covariance: (m, m).
    """

    mean: Array
    covariance: Array


def projected(A: Array, y: Array, J: Array, precision: Array) -> Projected:
    """Take nuisance parameters out.

    Args:
        A: (N, m) whitened errors that a weight of 1 leaves.
        y: (N,) whitened errors.
        J: (N, P) derivatives of the whitened errors by nuisance parameters.
        precision: (P,) Λ, of their prior.
    """
    H, JA, Jy = J.T @ J + np.diag(precision), J.T @ A, J.T @ y
    shift, moved = solve_normal(H, JA), -solve_normal(H, Jy)
    M = A.T @ A - JA.T @ shift
    return Projected(0.5 * (M + M.T), A.T @ y + JA.T @ moved, float(y @ y + Jy @ moved), shift, moved)


def evidence(found: Projected, spectra: Array, dispersion: float) -> PriorFit:
    """The evidence for a function, at its best length and size.

    Args:
        found: what the errors say.
        spectra: (L, m), as of `Smooth`.
        dispersion: κ.
    """
    best = PriorFit(0.0, np.zeros(len(found.b)))
    for spectrum in spectra:
        values, vectors, roots = _principal(found.M, spectrum, dispersion)
        along = (vectors.T @ (roots * found.b)) / dispersion
        sizes = _SIZES / max(float(values[-1]), 1e-300)
        gains = _gains(values, along[None, :] ** 2, sizes)[0]
        place = int(np.argmax(gains))
        if gains[place] > best.gain:
            best = PriorFit(float(gains[place]), sizes[place] * spectrum)
    return best


def null_gains(found: Projected, spectra: Array, dispersion: float, rng: np.random.Generator) -> Array:
    """Gains in log evidence where there is no function, drawn, (n,).

    Args:
        found: of which M counts.
        spectra: as of `evidence`.
        dispersion: κ.
        rng: of the draws.
    """
    values, vectors = np.linalg.eigh(found.M)
    noise = (vectors * np.sqrt(np.maximum(values, 0.0))) @ rng.standard_normal((len(values), _DRAWS))
    best = np.zeros(_DRAWS)
    for spectrum in spectra:
        values, vectors, roots = _principal(found.M, spectrum, dispersion)
        along = (vectors.T @ (roots[:, None] * noise)).T / np.sqrt(dispersion)
        gains = _gains(values, along**2, _SIZES / max(float(values[-1]), 1e-300))
        best = np.maximum(best, gains.max(axis=1))
    return best


def posterior_weights(found: Projected, prior: Array, dispersion: float) -> Weights:
    """The weights after the data; arguments as of `evidence`, the prior as of its answer."""
    roots = np.sqrt(prior)
    inner = np.eye(len(roots)) + roots[:, None] * found.M * roots / dispersion
    covariance = roots[:, None] * np.linalg.inv(inner) * roots
    return Weights(covariance @ found.b / dispersion, 0.5 * (covariance + covariance.T))


def _principal(M: Array, spectrum: Array, dispersion: float) -> tuple[Array, Array, Array]:
    """Eigenvalues and -vectors of S^½ M S^½ / κ, and the roots of S."""
    roots = np.sqrt(spectrum)
    values, vectors = np.linalg.eigh(roots[:, None] * M * roots / dispersion)
    return np.maximum(values, 0.0), vectors, roots


def _gains(values: Array, squares: Array, sizes: Array) -> Array:
    """Gains in log evidence (n, sizes) from eigenvalues (m,) and squares (n, m) of b along the eigenvectors."""
    grown = 1.0 + sizes[:, None] * values  # (sizes, m)
    return np.asarray(0.5 * squares @ (sizes[:, None] / grown).T - 0.5 * np.log(grown).sum(axis=1))
