"""From episodes to f, and from f to f + g."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from twbal.channels import Channels
from twbal.episode import Episode
from twbal.gaussian import Array
from twbal.models.dataset import residuals, transitions
from twbal.models.dynamics import DynamicsModel
from twbal.models.fit import Fit
from twbal.models.hyperparameters import Reference, spread


class Fitter(Protocol):
    """Learns GPs: `fit_gp` or `fit_sparse_gp` with its settings chosen."""

    def __call__(self, inputs: Array, targets: Array, *, seed: int, reference: Reference | None) -> Fit:
        """GPs of `targets` (n, E) over `inputs` (n, d)."""


def learn_f(
    episodes: Sequence[Episode], channels: Channels, fit: Fitter, keep_f_variance: bool, seed: int
) -> DynamicsModel:
    """The model of the simulated robot, from its episodes (eq. 4).

    Args:
        episodes: of the simulated robot.
        channels: the state; that of the episodes.
        fit: how GPs are learned.
        keep_f_variance: see `DynamicsModel`.
        seed: of the fit's random starts.

    Raises:
        DataError: the episodes cannot be used together, or have another state.
        FitError: they are too few.
    """
    data = transitions(episodes, channels)
    return DynamicsModel(channels, fit(data.inputs, data.targets, seed=seed, reference=None).gp, None, keep_f_variance)


def learn_g(model: DynamicsModel, episodes: Sequence[Episode], fit: Fitter, seed: int) -> DynamicsModel:
    """`model` with the difference that real episodes show learned afresh (eq. 5); an earlier g is not looked at.

    What priors of the fit are relative to: length-scales to the spread of f's inputs, noise to f's noise.

    Args:
        model: its f is kept.
        episodes: of the real robot, all of them.
        fit: how GPs are learned.
        seed: of the fit's random starts.

    Raises:
        DataError: the episodes cannot be used together, or have another state than the model.
        FitError: they are too few.
    """
    data = residuals(transitions(episodes, model.channels), model.f)
    reference = Reference(np.tile(spread(model.f.centres), (model.f.outputs, 1)), np.sqrt(model.f.noise_variance))
    return replace(model, g=fit(data.inputs, data.targets, seed=seed, reference=reference).gp)
