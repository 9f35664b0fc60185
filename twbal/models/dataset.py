"""From episodes to the samples that a GP learns from."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from twbal.core.channels import Channels
from twbal.core.episode import Episode
from twbal.core.errors import DataError
from twbal.core.gaussian import Array
from twbal.models.gp import Posterior


class Transitions(NamedTuple):
    """One row for each control period.

    Attributes:
        inputs: (n, d), of the state x_{t-1} and the command u_{t-1} what changes depend on (`Channels.inputs`).
        targets: (n, E), the change x_t - x_{t-1} of the E measured channels (of eq. 4), or what a model leaves of it.
    """

    inputs: Array
    targets: Array


def transitions(episodes: Sequence[Episode], channels: Channels) -> Transitions:
    """Every control period of every episode, in order; none is left out.

    Past commands among the channels are inputs only: they are copied from step to step, so there is nothing to learn.
    Of an episode with a reference the states are those over ground.

    Raises:
        DataError: an episode has other channels than `channels`, the control periods differ, or there is no sample.
    """
    for number, episode in enumerate(episodes):
        if episode.channels != channels.names:
            raise DataError(
                f"Episode {number} has the state channels {', '.join(episode.channels)}; expected are "
                f"{', '.join(channels.names)}. Collect it anew with this state, or choose the state it was made with."
            )
    episodes = [episode.over_ground() for episode in episodes]
    periods = sorted({episode.control_period for episode in episodes})
    if len(periods) > 1:
        raise DataError(
            f"The episodes have control periods of {periods} s; a model of one-step changes needs a single one."
        )
    if not sum(len(episode) for episode in episodes):
        raise DataError(f"There is no control period in {len(episodes)} episodes. Collect at least one rollout.")
    kept = list(channels.inputs)
    inputs = [np.column_stack([episode.states[:-1], episode.commands])[:, kept] for episode in episodes]
    changes = [np.diff(episode.states, axis=0)[:, list(channels.measured)] for episode in episodes]
    return Transitions(np.concatenate(inputs), np.concatenate(changes))


def residuals(data: Transitions, f: Posterior) -> Transitions:
    """What the simulation model f leaves for the difference model g to learn: Δ - E_f[Δ] at the same inputs."""
    if data.inputs.shape[1] != f.inputs or data.targets.shape[1] != f.outputs:
        raise DataError(
            f"The samples have {data.inputs.shape[1]} inputs and {data.targets.shape[1]} targets; the model f has "
            f"{f.inputs} and {f.outputs}. Was f learned with another state?"
        )
    return Transitions(data.inputs, data.targets - f.mean(data.inputs))
