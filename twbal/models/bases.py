"""Which simulation g is learned on top of: the one under which the real data have the greatest evidence.

A wrong f is worse than none where g has too few samples to correct it. With f as the prior mean of the dynamics, the
log marginal likelihood of the real transitions, log p(Δ | X, f) = Σ_a log N(Δ_a; f_a(X), K_a + σ_a² I) (Rasmussen and
Williams, eq. 2.30, with hyper-parameters that maximise it), says how well f and a g that could correct it explain them
together. The bases are compared on the transitions as measured: states that were smoothed by each model would be other
data for each base.
"""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from twbal.core.copies import shared
from twbal.core.episode import Episode
from twbal.core.gaussian import Array
from twbal.models.dynamics import DynamicsModel
from twbal.models.recipe import LearnedModel, ModelRecipe


class ChosenBase(NamedTuple):
    """What was learned on the likeliest of several bases.

    Attributes:
        learned: f + g on it.
        chosen: index of the base.
        log_evidences: (B, E) of the measured transitions, of each base and each measured channel [nats].
    """

    learned: LearnedModel
    chosen: int
    log_evidences: Array

    @property
    def totals(self) -> tuple[float, ...]:
        """Log evidence of each base over all channels [nats]."""
        return _totals(self.log_evidences)


def learn_on_likeliest(
    recipe: ModelRecipe, bases: Sequence[DynamicsModel], episodes: Sequence[Episode], seed: int
) -> ChosenBase:
    """g on top of that of several bases under which the episodes are likeliest; of equals the first.

    Args:
        recipe: how g is learned.
        bases: models with the candidates for f; one that says nothing (`without_simulation`) may be among them.
        episodes: all real ones.
        seed: of the fits.

    Raises:
        DataError: the episodes have other channels than a base, or cannot be used together.
        FitError: a model cannot be learned from them.
    """
    begun = shared([partial(recipe.learn_measured, base, episodes, seed) for base in bases])
    log_evidences = np.array([learned.log_evidence for learned in begun])  # (B, E)
    index = int(np.argmax(_totals(log_evidences)))
    return ChosenBase(recipe.learn_smoothed(begun[index], episodes, seed), index, log_evidences)


def _totals(log_evidences: Array) -> tuple[float, ...]:
    """Of each base, over all channels."""
    return tuple(sum(row) for row in log_evidences.tolist())
