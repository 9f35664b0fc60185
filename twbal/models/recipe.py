"""How the models of Algorithm 1 are learned: f from simulated episodes, g from what f leaves of the real ones."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np

from twbal.channels import Channels
from twbal.episode import Episode
from twbal.gaussian import Array
from twbal.models.dataset import Transitions, residuals, transitions
from twbal.models.dynamics import DynamicsModel
from twbal.models.fit import Fit
from twbal.models.hyperparameters import Reference, spread


class GpFit(Protocol):
    """Fits E GPs to inputs (n, d) and targets (n, E); `fit_gp` and `fit_sparse_gp`, their settings bound, are such."""

    def __call__(self, inputs: Array, targets: Array, *, seed: int, reference: Reference | None) -> Fit:
        """Fit, with priors relative to `reference` where there are priors."""
        ...


class LearnedModel(NamedTuple):
    """A model and what it was learned from.

    Attributes:
        model: of the dynamics.
        data: samples of the GP that was learned last: f, or g.
        log_evidence: (E,) of that GP [nats].
    """

    model: DynamicsModel
    data: Transitions
    log_evidence: Array


@dataclass(frozen=True)
class ModelRecipe:
    """How f and g are fitted.

    Attributes:
        fit_f: for the simulation model; it has no reference.
        fit_g: for the difference model; its priors are relative to the spread of f's inputs and to f's noise.
        keep_f_variance: count f's variance in; the paper drops it.
    """

    fit_f: GpFit
    fit_g: GpFit
    keep_f_variance: bool

    def learn_simulation(self, episodes: Sequence[Episode], channels: Channels, seed: int) -> LearnedModel:
        """Line 2 of Algorithm 1: f from simulated episodes.

        Raises:
            DataError: the episodes cannot be used together.
            FitError: a model cannot be learned from them.
        """
        data = transitions(episodes, channels)
        fit = self.fit_f(data.inputs, data.targets, seed=seed, reference=None)
        return LearnedModel(DynamicsModel(channels, fit.gp, None, self.keep_f_variance), data, fit.log_evidence)

    def learn_difference(self, model: DynamicsModel, episodes: Sequence[Episode], seed: int) -> LearnedModel:
        """Line 7 of Algorithm 1: `model` with a new g, from all real episodes so far.

        Raises:
            DataError: the episodes have other channels than the model, or cannot be used together.
            FitError: a model cannot be learned from them.
        """
        data = residuals(transitions(episodes, model.channels), model.f)
        length_scales = np.tile(spread(model.f.centres), (model.f.outputs, 1))
        reference = Reference(length_scales, np.sqrt(model.f.noise_variance))
        fit = self.fit_g(data.inputs, data.targets, seed=seed, reference=reference)
        return LearnedModel(replace(model, g=fit.gp), data, fit.log_evidence)
