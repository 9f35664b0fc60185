"""Exact GPs by evidence maximisation."""

from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.models.evidence import Evidence
from twbal.models.fit_settings import FitSettings, Reference
from twbal.models.gp import GaussianProcess, condition
from twbal.models.hyperparameters import fit_hyperparameters


class Fit(NamedTuple):
    """What a fit found.

    Attributes:
        gp: the posterior.
        log_evidence: (E,) log p(y | X) of each output [nats], without penalties and priors; of a sparse GP its bound.
    """

    gp: GaussianProcess
    log_evidence: Array


def fit_gp(inputs: Array, targets: Array, settings: FitSettings, seed: int, reference: Reference | None = None) -> Fit:
    """Exact GPs whose hyper-parameters maximise the evidence, less penalties and, where given, with priors.

    Args:
        inputs: (n, d), in any units.
        targets: (n, E).
        settings: how to search.
        seed: of the perturbed starts and of the samples that they compete on.
        reference: what the priors are relative to; None means std(X) and std(y)/10.

    Raises:
        FitError: too few samples, shapes that do not fit, a value that is not finite, a covariance that is too badly
            conditioned.
    """
    found = fit_hyperparameters(inputs, targets, settings, seed, reference)
    gp = condition(inputs, targets, *found)
    evidence = [Evidence(inputs, target)(found.theta(a))[0] for a, target in enumerate(targets.T)]
    return Fit(gp, np.array(evidence))
