"""How sure a fit may be: intervals from blocks of the data.

Errors of a model with a wrong form are neither white nor alike everywhere, and the curvature of the likelihood says too
little of them. Blocks of some seconds are nearly independent: how their slopes scatter gives the sandwich covariance.
"""

from collections.abc import Collection, Sequence
from itertools import pairwise
from math import sqrt

import numpy as np

from twbal.core.gaussian import Array
from twbal.sysid.model import Field, FreeParameter, Model
from twbal.sysid.normal_equations import inverse_of
from twbal.sysid.prediction_error_fit import Fit

NORMAL95 = 1.959964
"""Half the width of a 95 % interval of a normal value, in standard errors."""

_RIDGE = 1e-6


def _parts(count: int, blocks: int) -> list[slice]:
    ends = np.linspace(0, count // 4, blocks + 1).astype(int) * 4
    return [slice(a, b) for a, b in pairwise(ends)]


def curvature(free_parameters: Sequence[FreeParameter], J: Array, excess: float = 1.0) -> Array:
    """Half the second derivatives of a fit's cost, (P, P), from the slopes (N, P) and the priors.

    Args:
        free_parameters: with their priors.
        J: slopes of the whitened errors.
        excess: by how much products of these slopes exceed the curvature (`slope_excess.slope_excess`).
    """
    sds = np.array([free.sd for free in free_parameters])
    ranges = np.array([free.high - free.low for free in free_parameters])
    H: Array = J.T @ J / excess + np.diag(1.0 / sds**2 + _RIDGE / ranges**2)
    return H


def prior_slopes(free_parameters: Sequence[FreeParameter], model: Model) -> Array:
    """Half the slopes of the priors' part of a fit's cost, (P,), at the values of a model."""
    means, sds = np.array([free.mean for free in free_parameters]), np.array([free.sd for free in free_parameters])
    values = np.array([model.value(free.field) for free in free_parameters])
    return np.asarray((values - means) / sds**2)


def standard_errors(fit: Fit, J: Array, blocks: int, temperature: float = 1.0, excess: float = 1.0) -> Array:
    """Standard errors of the free values, (P,): of the curvature or of the sandwich, whichever is larger.

    Args:
        fit: at its optimum.
        J: (N, P), slopes of its whitened errors.
        blocks: into which the data are cut.
        temperature: of a power likelihood, by the square root of which the fit's priors are narrower than they are.
        excess: as of `curvature`.
    """
    free_parameters = [free._replace(sd=free.sd * sqrt(temperature)) for free in fit.free_parameters]
    inverse = inverse_of(curvature(free_parameters, J, excess))
    pulls = np.array([J[part].T @ fit.white[part] for part in _parts(len(fit.white), blocks)])  # (B, P)
    pulls -= pulls.mean(axis=0)
    spread = pulls.T @ pulls * blocks / (blocks - 1)
    sandwich = inverse @ spread @ inverse
    return np.sqrt(np.maximum(np.diag(inverse), np.diag(sandwich)))


def drawn_values(
    fit: Fit, J: Array, blocks: int, temperature: float, held: Collection[Field], count: int, excess: float = 1.0
) -> list[dict[Field, float]]:
    """Values of a fit drawn from what the data leave open about them, within their bounds.

    They are normal, with the correlations of the curvature and with standard errors that the sandwich enlarges as it
    does those of `standard_errors`.

    Args:
        fit, J, blocks, temperature, excess: as of `standard_errors`.
        held: fields that stay as they are; the others are drawn given these.
        count: of the draws; the same each time.
    """
    free_parameters = [free._replace(sd=free.sd * sqrt(temperature)) for free in fit.free_parameters]
    alone = np.sqrt(np.diag(inverse_of(curvature(free_parameters, J, excess))))
    enlarged = standard_errors(fit, J, blocks, temperature, excess) / alone
    open_ones = [i for i, free in enumerate(free_parameters) if free.field not in held]
    moving = [free_parameters[i] for i in open_ones]
    covariance = inverse_of(curvature(moving, J[:, open_ones], excess))
    sds = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(sds, sds))
    normals = np.random.default_rng(0).standard_normal((count, len(moving)))
    by = (normals * np.sqrt(np.maximum(values, 0.0))) @ vectors.T * sds * enlarged[open_ones]
    return [
        {
            free.field: float(np.clip(fit.model.value(free.field) + step, free.low, free.high))
            for free, step in zip(moving, row, strict=True)
        }
        for row in by
    ]


def interval(value: float, error: float) -> tuple[float, float]:
    """Ends of the 95 % interval."""
    return value - NORMAL95 * error, value + NORMAL95 * error
