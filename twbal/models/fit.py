"""Exact GPs by evidence maximisation."""

from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.core.threads import in_threads
from twbal.models.evidence import Evidence
from twbal.models.fit_settings import FitSettings, PriorReference
from twbal.models.gp import SQUARED_EXPONENTIAL, Posterior, condition
from twbal.models.hyperparameters import Hyperparameters, fit_hyperparameters


class GpFitResult(NamedTuple):
    """What a fit found.

    Attributes:
        gp: the posterior.
        log_evidence: (E,) log p(y | X) of each output [nats], without penalties and priors; of a sparse GP its bound.
    """

    gp: Posterior
    log_evidence: Array


def fit_gp(
    inputs: Array,
    targets: Array,
    settings: FitSettings,
    seed: int,
    reference: PriorReference | None = None,
    kernel: str = SQUARED_EXPONENTIAL,
    near: Hyperparameters | None = None,
) -> GpFitResult:
    """Exact GPs whose hyper-parameters maximise the evidence, less penalties and, where given, with priors.

    Args:
        inputs: (n, d), in any units.
        targets: (n, E).
        settings: how to search.
        seed: of the perturbed starts and of the samples that they compete on.
        reference: what the priors are relative to; None means std(X) and std(y)/10.
        kernel: the squared exponential one, by closed forms; or an expression of names (`models.kernels.expression`),
            by GPyTorch.
        near: hyper-parameters of much the same samples, from which the search of the closed forms goes on.

    Raises:
        ConfigError: `kernel` is none.
        FitError: too few samples, shapes that do not fit, a value that is not finite, a covariance that is too badly
            conditioned.
    """
    if kernel != SQUARED_EXPONENTIAL:
        from twbal.models.kernels.exact import fit_exact  # here, as GPyTorch takes a while to import

        return fit_exact(inputs, targets, kernel, settings, seed, reference)
    found = fit_hyperparameters(inputs, targets, settings, seed, reference, near)
    gp = condition(inputs, targets, *found)
    evidence = in_threads(lambda a: Evidence(inputs, targets[:, a])(found.theta(a))[0], range(targets.shape[1]))
    return GpFitResult(gp, np.array(evidence))
