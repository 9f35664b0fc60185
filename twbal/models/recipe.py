"""How the models of Algorithm 1 are learned: f from simulated episodes, g from what f leaves of the real ones."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np

from twbal.core.channels import Channels
from twbal.core.episode import Episode
from twbal.core.gaussian import Array
from twbal.models.dataset import Transitions, residuals, transitions, unbroken
from twbal.models.dynamics import DynamicsModel
from twbal.models.fit import GpFitResult
from twbal.models.fit_settings import PriorReference, input_scales
from twbal.models.gp import SQUARED_EXPONENTIAL, GaussianProcess, Posterior
from twbal.models.hyperparameters import Hyperparameters
from twbal.models.smoothing import NoiseLevels, SmoothingSettings, samples, smooth


class GpFit(Protocol):
    """Fits E GPs to inputs (n, d) and targets (n, E); `fit_gp` and `fit_sparse_gp`, their settings bound, are such."""

    def __call__(
        self,
        inputs: Array,
        targets: Array,
        *,
        seed: int,
        reference: PriorReference | None,
        kernel: str,
        near: Hyperparameters | None = None,
    ) -> GpFitResult:
        """Fit GPs with a kernel, with priors relative to `reference` where there are priors.

        `near` is a fit to much the same samples, of which some of the search can be spared.
        """
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
        smoothing: of the real episodes' states before g is learned from them; None learns from the measurements as they
            are, as the paper does, and lets the state's uncertainty grow by g's noise at each step.
        kernel: of f and g; see `fit_gp`.
    """

    fit_f: GpFit
    fit_g: GpFit
    keep_f_variance: bool
    smoothing: SmoothingSettings | None
    kernel: str = SQUARED_EXPONENTIAL

    def learn_simulation(self, episodes: Sequence[Episode], channels: Channels, seed: int) -> LearnedModel:
        """Line 2 of Algorithm 1: f from simulated episodes.

        Raises:
            DataError: the episodes cannot be used together.
            FitError: a model cannot be learned from them.
        """
        data = transitions(episodes, channels)
        fit = self.fit_f(data.inputs, data.targets, seed=seed, reference=None, kernel=self.kernel)
        known = np.zeros(len(channels.measured))
        model = DynamicsModel(channels, fit.gp, None, self.keep_f_variance, fit.gp.noise_variance, known)
        return LearnedModel(model, data, fit.log_evidence)

    def learn_difference(self, model: DynamicsModel, episodes: Sequence[Episode], seed: int) -> LearnedModel:
        """Line 7 of Algorithm 1: `model` with a new g, from all real episodes so far.

        On top of an f that says nothing (`without_simulation`), g is the whole dynamics; priors are relative to the
        data then.

        Raises:
            DataError: the episodes have other channels than the model, or cannot be used together.
            FitError: a model cannot be learned from them.
        """
        return self.learn_smoothed(self.learn_measured(model, episodes, seed), episodes, seed)

    def learn_measured(self, model: DynamicsModel, episodes: Sequence[Episode], seed: int) -> LearnedModel:
        """`model` with a new g, from all real episodes as they were measured.

        Raises: as `learn_difference`.
        """
        return self._fit_difference(model, residuals(transitions(episodes, model.channels), model.f), seed)

    def learn_smoothed(self, learned: LearnedModel, episodes: Sequence[Episode], seed: int) -> LearnedModel:
        """What was learned from episodes as measured, learned again from smoothed states, where that is asked for.

        Where samples are missing, an episode ends; the next begins as soon as all past commands are known again.

        Raises: as `learn_difference`.
        """
        if self.smoothing is None:
            return learned
        base = replace(learned.model, g=None)
        episodes = unbroken([episode.over_ground() for episode in episodes], base.channels)
        names = [base.channels.names[i] for i in base.channels.measured]
        levels = NoiseLevels(self.smoothing.sensor_variances(names), learned.model.process_noise)
        for _ in range(self.smoothing.rounds):
            levels, states = smooth(learned.model, episodes, levels, self.smoothing)
            learned = self._fit_difference(base, samples(episodes, states, base), seed, learned.model.g)
            levels = NoiseLevels(self.smoothing.sensor_variances(names), levels.process)
        levels, _ = smooth(learned.model, episodes, levels, self.smoothing)
        model = replace(learned.model, process_noise=levels.process, observation_noise=levels.sensors)
        return learned._replace(model=model)

    def _fit_difference(
        self, model: DynamicsModel, data: Transitions, seed: int, before: Posterior | None = None
    ) -> LearnedModel:
        """`model` with a g from `data`, whose noise counts as process noise; `before` is one of the data before."""
        reference, near = None, None
        if isinstance(before, GaussianProcess):
            near = Hyperparameters(before.length_scales, before.signal_variance, before.noise_variance)
        if model.has_simulation:
            length_scales = np.tile(input_scales(model.f.centres), (model.f.outputs, 1))
            reference = PriorReference(length_scales, np.sqrt(model.f.noise_variance))
        fit = self.fit_g(data.inputs, data.targets, seed=seed, reference=reference, kernel=self.kernel, near=near)
        noise = fit.gp.noise_variance
        with_g = replace(model, g=fit.gp, process_noise=noise)
        return LearnedModel(with_g, data, fit.log_evidence)
